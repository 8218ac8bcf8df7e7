"""Reports in a real browser: nothing is complained of, plots answer, the view draws, nothing sticks out.

Chromium through Selenium, as Debian has them; skipped where they are not.
"""

from __future__ import annotations

import contextlib
import io
import re
import shutil
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pages import ROOT
from PIL import Image

import erls
from erls.cli.main import main
from erls.view.stress import chain_values

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
pytestmark = [
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="no chromium with its driver (Debian: chromium-driver)"),
    pytest.mark.xdist_group("browser"),
]
SHORT = ("--set", "simulation.duration=0.02")
PAGES = {
    "steel_tall": ("data/l_shape/steel_tall.toml", ["simulation.duration=0.2"]),
    "two_link": ("data/robot/two_link.toml", ["simulation.duration=0.2"]),
    "solid": ("data/l_shape/solid.toml", ["simulation.duration=0.02"]),
    "roll_up": ("data/statics/roll_up.toml", []),
    "parallel_robot": ("data/five_bar/parallel_robot.toml", ["simulation.duration=0.02"]),
    "bracket": ("data/shells/bracket_arm.toml", ["simulation.duration=0.1"]),
}
COMMANDS = {
    "optimum": ("optimize", "data/optimization/cantilever.toml", "--set", 'settings.methods=["esl-system"]'),
    "inversion": ("invert", "data/inverse/passive_arm.toml", "--set", "simulation.step=0.02"),
    "modes": ("study", "modes", "data/l_shape/mode_study.toml", "--counts", "1,24", *SHORT),
    "comparison": ("compare", "data/l_shape/steel_flat.toml", *SHORT),
}
VIEWLESS = ("inversion", "modes", "comparison")
DESKTOP, PHONE = (1280, 900), (360, 780)


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Addresses of reports."""
    folder = tmp_path_factory.mktemp("pages")
    for name, (scene, settings) in PAGES.items():
        erls.write_view(erls.simulate(erls.load_scene(ROOT / scene, settings)), folder / f"{name}.html")
    for name, words in COMMANDS.items():
        command = [str(ROOT / word) if word.startswith("data/") else word for word in words]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            assert main([*command, "-o", str(folder / f"{name}.html")]) == 0
    return {name: (folder / f"{name}.html").as_uri() for name in (*PAGES, *COMMANDS)}


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Without a window; drawing in space by software."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    software = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-process-crash-limit")
    awake = ("--disable-background-timer-throttling", "--disable-renderer-backgrounding", "--disable-dev-shm-usage")
    for argument in ("--headless=new", "--no-sandbox", *software, *awake):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    found = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    found.set_script_timeout(60)
    yield found
    found.quit()


def opened(browser: Any, page: str, size: tuple[int, int], scheme: str = "light") -> None:
    """A page, everything in it drawn."""
    _look_at(browser, size)
    media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    browser.get(page)
    browser.execute_script("['beforeprint', 'afterprint'].forEach(name => dispatchEvent(new Event(name)))")


def _look_at(browser: Any, size: tuple[int, int]) -> None:
    width, height = size
    screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": size == PHONE}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)


def said(browser: Any) -> list[str]:
    """Complaints; those of software drawing about its own speed are none of the page's."""
    messages = [entry["message"] for entry in browser.get_log("browser")]
    return [text for text in messages if "GL Driver Message" not in text]


@pytest.mark.parametrize("name", [name for name in (*PAGES, *COMMANDS) if name != "two_link"])
def test_pages_draw_everything_without_a_complaint(name: str, browser: Any, pages: dict[str, str]) -> None:
    """Every plot has its curves, the view shows something bent; dark pages are dark."""
    for scheme in ("light", "dark") if name == "steel_tall" else ("light",):
        for _ in range(2):  # a browser whose drawing in space stalled draws a page that is loaded again
            opened(browser, pages[name], DESKTOP, scheme)
            if _until(browser, _all_drawn):
                break
        assert _all_drawn(browser), (_curves(browser), browser.get_log("browser"))
        if name not in VIEWLESS:
            browser.execute_script(
                "document.querySelector('.view').scrollIntoView({block: 'center'});"
                "const slider = document.querySelector('.controls input');"
                "slider.value = slider.max; slider.dispatchEvent(new Event('input'))"
            )
            assert _until(browser, lambda browser: _colours(browser) >= 2), browser.get_log("browser")
        shade = browser.execute_script("return getComputedStyle(document.body).backgroundColor")
        assert (sum(int(x) for x in shade[4:-1].split(",")) < 200) == (scheme == "dark")
        assert said(browser) == []
    _assert_inside(browser, DESKTOP)
    _look_at(browser, PHONE)
    assert _until(browser, lambda browser: browser.execute_script("return document.documentElement.scrollWidth") <= 360)
    _assert_inside(browser, PHONE)


def _until(browser: Any, held: Callable[[Any], bool]) -> bool:
    """Whether something holds within half a minute."""
    from selenium.common.exceptions import TimeoutException
    from selenium.webdriver.support.ui import WebDriverWait

    try:
        return bool(WebDriverWait(browser, 30, 0.2).until(held))
    except TimeoutException:
        return False


def _all_drawn(browser: Any) -> bool:
    """Every plot has all its curves, and there are plots."""
    curves = _curves(browser)
    return bool(curves) and all(found == asked for found, asked in curves)


def _curves(browser: Any) -> list[list[int]]:
    """Of each plot: curves that are drawn, and that are asked for."""
    found: list[list[int]] = browser.execute_script(
        "const asked = box => JSON.parse(document.getElementById(box.id + '-data').textContent).curves.length;"
        "const drawn = box => box.querySelectorAll('.scatterlayer .trace').length;"
        "return [...document.querySelectorAll('.plot')].map(box => [drawn(box), asked(box)])"
    )
    return found


def _colours(browser: Any) -> int:
    """How many clearly different colours a view has in its middle."""
    view = browser.find_element("css selector", ".view")
    with Image.open(BytesIO(view.screenshot_as_png)) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    high, wide = pixels.shape[:2]
    middle = pixels[high // 5 : -high // 5, wide // 5 : -wide // 5].reshape(-1, 3)
    coloured = middle[np.ptp(middle, axis=1) > 25]
    return len(np.unique(coloured // 32, axis=0)) if len(coloured) > 30 else 0


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_nothing_sticks_out(size: tuple[int, int], browser: Any, pages: dict[str, str]) -> None:
    """Of a page that is opened at this size."""
    opened(browser, pages["two_link"], size)
    _assert_inside(browser, size)


def _assert_inside(browser: Any, size: tuple[int, int]) -> None:
    """No sideways scroll, also on a phone; tables that are wider scroll by themselves, on a desk none is."""
    assert browser.execute_script("return document.documentElement.scrollWidth") <= size[0]
    widest = browser.execute_script(
        "const boxes = [...document.querySelectorAll('.plot, .view, p, .wide')];"
        "return Math.max(...boxes.map(box => box.getBoundingClientRect().right))"
    )
    assert widest <= size[0]
    if size == DESKTOP:
        boxes = "return [...document.querySelectorAll('.wide')].map(box => box.scrollWidth - box.clientWidth)"
        assert max(browser.execute_script(boxes), default=0) <= 0


def test_pointing_tells_values_and_moves_one_cursor(browser: Any, pages: dict[str, str]) -> None:
    """Values of the run at that time; the other plots over time show it, too; a name in the legend hides its curve."""
    from selenium.webdriver import ActionChains

    opened(browser, pages["two_link"], DESKTOP)
    plots = browser.find_elements("css selector", ".plot")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", plots[0])
    ActionChains(browser).move_to_element_with_offset(plots[0], 40, -20).pause(0.5).perform()
    told = plots[0].find_element("css selector", ".hoverlayer .legend, .hoverlayer").text
    assert "x" in told
    cursors = browser.execute_script(
        "return [...document.querySelectorAll('.plot')].slice(0, 2).map(b => (b.layout.shapes || []).length)"
    )
    assert cursors == [0, 1]
    toggle = plots[0].find_element("css selector", ".legendtoggle")
    ActionChains(browser).move_to_element(toggle).click().pause(0.8).perform()
    assert browser.execute_script("return arguments[0].data[0].visible", plots[0]) == "legendonly"


def test_the_view_plays_and_magnifies(browser: Any, pages: dict[str, str]) -> None:
    """Time goes on, stops, and the displacement grows as it is told."""
    opened(browser, pages["two_link"], DESKTOP)
    view = browser.find_element("css selector", ".view")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", view)
    play = browser.find_element("css selector", "button.play")
    play.click()
    browser.execute_async_script("setTimeout(arguments[0], 1500)")
    play.click()
    frame = int(view.get_attribute("data-frame"))
    assert frame > 0
    reach = "const z = document.querySelector('.view').data[1].z.filter(v => v !== null); return z[z.length - 1]"
    before = browser.execute_script(reach)
    browser.execute_script(
        "const slider = document.querySelectorAll('.controls input')[1];"
        "slider.value = 1; slider.dispatchEvent(new Event('input'))"
    )
    assert browser.execute_script("return document.querySelectorAll('.controls output')[1].value") == "× 10.0"
    assert abs(browser.execute_script(reach) - before) > 1e-6


def test_colours_show_stress_where_it_is_recovered(browser: Any, pages: dict[str, str]) -> None:
    """In MPa, up to the largest of the run; links that hold none are grey. Pages without any have nothing to choose."""
    choose = "const shade = document.querySelector('.controls select'); shade.value = arguments[0];"
    choose += "shade.dispatchEvent(new Event('change'))"
    told = "const [a, b] = document.querySelector('.view').data; const of = part => part.line ?? part;"
    told += "const bar = [of(a), of(b)].find(one => one.colorbar);"
    told += "return [bar.colorbar.title.text, bar.cmax, of(b).color]"
    opened(browser, pages["bracket"], DESKTOP)
    name, most, _ = browser.execute_script(told)
    assert name == "deflection [mm]"
    browser.execute_script(choose, "stress")
    name, stress, other = browser.execute_script(told)
    assert name == "stress, von Mises [MPa]"
    scene, settings = PAGES["bracket"]
    run = erls.simulate(erls.load_scene(ROOT / scene, settings), verdict=False)
    times = "return JSON.parse(document.getElementById(document.querySelector('.view').id + '-data').textContent).times"
    [found] = [own for own in chain_values(run, browser.execute_script(times)) if own is not None]
    assert stress == pytest.approx(np.nanmax(found), rel=1e-4)  # hubs of holes hold none
    assert stress != most
    assert isinstance(other, str)  # the arm, one colour
    assert said(browser) == []
    opened(browser, pages["two_link"], DESKTOP)
    assert browser.find_elements("css selector", ".controls select") == []


def test_nothing_is_plotted_that_is_nothing(pages: dict[str, str]) -> None:
    """Moments of hinges that turn freely in a plane are named, not drawn; nor angles that are the coordinates."""
    text = Path(pages["parallel_robot"].removeprefix("file://")).read_text(encoding="utf-8")
    assert re.search(r"left_elbow\.moment, .*which is rounding", text)
    assert "<figcaption>left_elbow.force<" in text
    assert "<figcaption>left_elbow.moment<" not in text
    assert "Joint angles are the same." in text
    assert "<h2 id=\"joint-angles\">" not in text
    assert "Effects" in text
    assert "centrifugal_load" in text


def test_dark_pages_are_printed_in_dark_ink(browser: Any, pages: dict[str, str]) -> None:
    """Words of plots are light on the screen, black on paper, and light again."""
    opened(browser, pages["steel_tall"], DESKTOP, "dark")
    shade = "return getComputedStyle(document.querySelector('.plot .xtick text')).fill.match(/\\d+/g).map(Number)"
    found = []
    for event in ("", "beforeprint", "afterprint"):
        browser.execute_script("if (arguments[0]) dispatchEvent(new Event(arguments[0]))", event)
        found.append(sum(browser.execute_script(shade)))
    assert found[0] == found[2] > 600
    assert found[1] == 0
    assert said(browser) == []


def test_tables_sort_by_their_heads(browser: Any, pages: dict[str, str]) -> None:
    """Numbers as numbers; once more turns the order."""
    opened(browser, pages["two_link"], DESKTOP)
    column = "return [...document.querySelectorAll('table')[0].tBodies[0].rows].map(r => r.cells[1].textContent)"
    head = browser.find_elements("css selector", "table th button")[1]
    for turned in (False, True):
        browser.execute_script("arguments[0].click()", head)
        values = [float(text) for text in browser.execute_script(column)]
        assert values == sorted(values, reverse=turned)


def test_pages_of_links_stay_small(pages: dict[str, str]) -> None:
    """At most 5 MB; no address of a network in them but those in remarks."""
    for address in pages.values():
        text = Path(address.removeprefix("file://")).read_text(encoding="utf-8")
        assert len(text.encode()) < 5e6
        assert 'src="http' not in text
