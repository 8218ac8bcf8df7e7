"use strict";
// Plots and the view of a page: drawn when they come into sight, in the colours of the page, with one cursor over time.
(() => {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const read = (box) => JSON.parse(document.getElementById(box.id + "-data").textContent);
  const PAPER = { text: "#000", soft: "#444", paper: "#fff", grid: "#bbb" }; // as in print, of which no script can ask
  let printing = false;
  const colour = (name) => (printing && PAPER[name]) || getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const LIGHT = ["#3d55c8", "#c25b00", "#1f7a4d", "#b3261e", "#7a3fa0", "#5a6169", "#0a7d8c", "#a0206e", "#7d6608", "#1d6fb8", "#5b4636", "#4f7a00"];
  const DARK = ["#9db0ff", "#ffb066", "#7fd3a3", "#f28b82", "#cfa3f0", "#b8bec4", "#6fd3e0", "#f29ac8", "#e3d26f", "#7cc0f5", "#cbb3a1", "#b5dd6a"];
  const drawn = [];
  const still = { displaylogo: false, displayModeBar: matchMedia("(hover: hover)").matches ? "hover" : false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };

  const bar = () => ({ bgcolor: "rgba(0,0,0,0)", color: colour("soft"), activecolor: colour("text") });
  const axis = (title, log) => ({
    title: { text: title, standoff: 8 }, type: log ? "log" : "linear", gridcolor: colour("grid"), zeroline: false,
    linecolor: colour("grid"), automargin: true, exponentformat: "power", fixedrange: false,
  });

  function shapes(plot, x) {
    const line = { color: colour("soft"), width: 1 }, found = [];
    if (plot.limit !== null) {
      found.push({ type: "line", xref: "paper", x0: 0, x1: 1, y0: plot.limit, y1: plot.limit, line: { ...line, dash: "dot" } });
    }
    if (x !== null) found.push({ type: "line", yref: "paper", y0: 0, y1: 1, x0: x, x1: x, line });
    return found;
  }

  function counts(plot) { // along numbers of modes or steps no mark stands between two of them
    const all = plot.curves.flatMap((curve) => curve.x);
    if (plot.logarithmic.includes("x") || !all.length || !all.every(Number.isInteger)) return {};
    return { tick0: 0, dtick: Math.max(1, Math.ceil((Math.max(...all) - Math.min(...all)) / 10)) };
  }

  function layout(plot) {
    return {
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", colorway: dark.matches && !printing ? DARK : LIGHT,
      font: { color: colour("text"), size: 12, family: "system-ui, sans-serif" }, margin: { l: 62, r: 12, t: 12, b: 48 },
      xaxis: { ...axis(plot.x, plot.logarithmic.includes("x")), showspikes: true, spikemode: "across", spikesnap: "cursor",
        spikethickness: 1, spikecolor: colour("soft"), spikedash: "solid", ...counts(plot) },
      yaxis: { ...axis(plot.y, plot.logarithmic.includes("y")) }, hovermode: "x unified", shapes: shapes(plot, null),
      hoverlabel: { bgcolor: colour("paper"), font: { color: colour("text") } },
      modebar: bar(), legend: { orientation: "h", y: -0.22, x: 0 }, showlegend: plot.curves.length > 1,
    };
  }

  function traces(plot) {
    return plot.curves.map((curve) => ({
      type: "scatter", name: curve.label, x: curve.x, y: curve.y, mode: curve.mode,
      line: { width: 1.6, dash: curve.dashed ? "dash" : "solid", simplify: false }, marker: { size: 5 }, connectgaps: false,
      hovertemplate: "%{y:.5~g}", showlegend: true,
    }));
  }

  function drawPlot(box) {
    const plot = read(box), longest = Math.max(...plot.curves.map((curve) => curve.label.length));
    const rows = Math.ceil(plot.curves.length / Math.max(1, Math.floor(box.clientWidth / (7 * longest + 45))));
    box.style.height = `${box.clientHeight + 19 * (rows - 1)}px`; // a legend of many rows takes nothing from the plot
    Plotly.newPlot(box, traces(plot), layout(plot), still);
    const entry = { box, plot };
    drawn.push(entry);
    box.on("plotly_hover", (event) => { if (event.points.length) point(plot.x, event.points[0].x, entry); });
    box.on("plotly_unhover", () => point(plot.x, null, entry));
  }

  // One cursor in all plots over the same axis: set by pointing at one of them, or by the time of the view.
  let pointed = 0;
  function point(label, x, except) {
    cancelAnimationFrame(pointed);
    pointed = requestAnimationFrame(() => {
      for (const { box, plot } of drawn) {
        if (plot === null || plot.x !== label || plot.logarithmic.includes("x")) continue;
        const at = except?.box === box ? null : x; // the one that is pointed at has a line of its own
        const { top, bottom } = box.getBoundingClientRect();
        if (bottom < -200 || top > innerHeight + 200) continue;
        if (at !== null || box.layout.shapes?.length) Plotly.relayout(box, { shapes: shapes(plot, at) });
      }
    });
  }

  // ----- the mechanism, which one can turn and play

  const numbers = (text) => {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
    return new Float32Array(bytes.buffer);
  };

  function drawView(box) {
    const told = read(box), frames = told.times.length;
    const parts = told.parts.map((part) => ({ ...part, rest: numbers(part.rest), moved: numbers(part.moved),
      weights: part.weights ? numbers(part.weights) : null, stress: part.stress ? numbers(part.stress) : null }));
    const controls = document.getElementById(box.id + "-controls");
    const [time, factor] = controls.querySelectorAll("input"), [timeText, factorText] = controls.querySelectorAll("output");
    const play = controls.querySelector("button"), shade = controls.querySelector("select");
    time.max = frames - 1;
    let largest = 0, farthest = 0, hardest = 0;
    for (const part of parts) {
      for (const value of part.stress ?? []) if (value > hardest) hardest = value;
      for (const value of part.rest) farthest = Math.max(farthest, Math.abs(value));
      for (let k = 0; k < part.moved.length; k += 3) {
        largest = Math.max(largest, Math.hypot(part.moved[k], part.moved[k + 1], part.moved[k + 2]));
      }
    }
    const magnification = () => Math.pow(10, Number(factor.value));

    // What is drawn at a frame: nodes, or the corners of a rigid surface, which are weighted sums of nodes.
    function drawnAt(part, frame, values) {
      const n = part.nodes, own = values.subarray(frame * n * 3, (frame + 1) * n * 3);
      if (!part.weights) return own;
      const found = new Float32Array((part.weights.length / n) * 3);
      for (let i = 0; i < found.length; i++) {
        const row = Math.floor(i / 3) * n;
        for (let k = 0; k < n; k++) found[i] += part.weights[row + k] * own[3 * k + (i % 3)];
      }
      return found;
    }

    function places(part, frame) {
      const scale = magnification(), found = { x: [], y: [], z: [], size: [] };
      const rest = drawnAt(part, frame, part.rest), moved = drawnAt(part, frame, part.moved);
      const stress = part.stress && stressed() ? part.stress.subarray((frame * rest.length) / 3, ((frame + 1) * rest.length) / 3) : null;
      for (let i = 0; i < rest.length; i += 3) {
        const dx = moved[i], dy = moved[i + 1], dz = moved[i + 2];
        found.x.push(rest[i] + scale * dx); found.y.push(rest[i + 1] + scale * dy);
        found.z.push(rest[i + 2] + scale * dz);
        found.size.push(stress === null ? 1e3 * Math.hypot(dx, dy, dz) : Number.isNaN(stress[i / 3]) ? -UNKNOWN * hardest : stress[i / 3]);
      }
      return found;
    }

    function along(found, lines) {
      const path = { x: [], y: [], z: [], size: [] };
      for (const run of lines) {
        for (const k of run) for (const name of ["x", "y", "z", "size"]) path[name].push(found[name][k]);
        for (const name of ["x", "y", "z"]) path[name].push(null);
        path.size.push(0);
      }
      return path;
    }

    const COLOURS = ["#4c5bd4", "#29a9d8", "#5cc26a", "#e8b03a", "#c62828"].map((c, k) => [k / 4, c]);
    const GREY = "#8a9096", UNKNOWN = 0.02; // grey below nothing: stress that is not known at a node
    const above = (x) => (UNKNOWN + x) / (1 + UNKNOWN);
    const stressed = () => shade !== null && shade.value === "stress";
    function colours() {
      if (!stressed()) return { colorscale: COLOURS, cmin: 0, cmax: largest > 1e-12 * farthest ? 1e3 * largest : 1 }; // less is rounding
      const known = COLOURS.map(([x, c]) => [above(x), c]);
      return { colorscale: [[0, GREY], [0.9 * above(0), GREY], ...known], cmin: -UNKNOWN * hardest, cmax: hardest || 1 };
    }
    const narrow = () => box.clientWidth < 560;
    function legend() {
      const side = narrow() ? { orientation: "h", x: 0.5, y: -0.02, yanchor: "top", len: 0.9 } : { len: 0.7 };
      const text = stressed() ? "stress, von Mises [MPa]" : "deflection [mm]";
      return { title: { text, side: narrow() ? "bottom" : "right" }, thickness: 12, outlinewidth: 0, ...side };
    }
    function trace(part, frame, first) {
      const found = places(part, frame), scale = colours(), colorbar = legend();
      const plain = stressed() && !part.stress; // a part that tells no stress
      if (part.triangles.length) {
        const [i, j, k] = [0, 1, 2].map((n) => part.triangles.map((t) => t[n]));
        const surface = { type: "mesh3d", name: part.name, x: found.x, y: found.y, z: found.z, i, j, k, hoverinfo: "name", flatshading: false };
        return plain ? { ...surface, color: GREY } : { ...surface, intensity: found.size, ...scale, showscale: first, colorbar };
      }
      const path = along(found, part.lines);
      const told = { type: "scatter3d", name: part.name, x: path.x, y: path.y, z: path.z, hoverinfo: "name", showlegend: false };
      const drawn = (size, values) => (plain ? { ...size, color: GREY } : { ...size, color: values, ...scale, showscale: first, colorbar });
      if (!part.lines.length) return { ...told, ...found, mode: "markers", marker: drawn({ size: 5 }, found.size) };
      return { ...told, mode: "lines", line: drawn({ width: 7 }, path.size) };
    }

    const all = (frame) => {
      const first = parts.findIndex((part) => !stressed() || part.stress);
      return parts.map((part, k) => trace(part, frame, k === first));
    };
    const side = (title) => ({ title: { text: title }, gridcolor: colour("grid"), color: colour("text"), backgroundcolor: "rgba(0,0,0,0)",
      showbackground: false });
    function ranges() {
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity], s = magnification();
      for (const part of parts) {
        for (let frame = 0; frame < frames; frame++) {
          const rest = drawnAt(part, frame, part.rest), moved = drawnAt(part, frame, part.moved);
          for (let k = 0; k < rest.length; k++) {
            const value = rest[k] + s * moved[k];
            low[k % 3] = Math.min(low[k % 3], value); high[k % 3] = Math.max(high[k % 3], value);
          }
        }
      }
      const reach = Math.max(...high.map((value, k) => value - low[k])) || 1;
      return low.map((value, k) => { const m = (value + high[k]) / 2, r = Math.max((high[k] - value) / 2, 0.12 * reach); return [m - 1.05 * r, m + 1.05 * r]; });
    }
    function ratio(...sides) { // true to scale, the longest side always as large
      const lengths = sides.map(([low, high]) => high - low), longest = Math.max(...lengths);
      const [x, y, z] = lengths.map((length) => (1.3 * length) / longest);
      return { x, y, z };
    }
    const FROM = [0.607, -0.693, 0.39], HALF = Math.tan(Math.PI / 8); // where one looks from, and half of what is seen
    function eye(sides) { // as near as all corners of the box are in sight, with their marks
      const across = [0.752, 0.659, 0], up = [-0.257, 0.293, 0.921], shape = box.clientWidth / box.clientHeight;
      const along = (axis, signs) => axis.reduce((sum, a, k) => sum + 0.5 * a * signs[k] * sides[k], 0);
      let distance = 0;
      for (let n = 0; n < 8; n++) {
        const signs = [1, 2, 4].map((bit) => (n & bit ? 1 : -1));
        const seen = Math.max(Math.abs(along(up, signs)), Math.abs(along(across, signs)) / shape) + 0.2;
        distance = Math.max(distance, along(FROM, signs) + seen / HALF);
      }
      const [x, y, z] = FROM.map((a) => a * distance);
      return { x, y, z };
    }
    let fitted = "";
    function camera(aspect) { // kept once somebody turned it
      const found = box.layout?.scene?.camera;
      if (found && JSON.stringify(found.eye) !== fitted) return found;
      const at = eye([aspect.x, aspect.y, aspect.z]);
      fitted = JSON.stringify(at);
      return { eye: at };
    }
    function scene() {
      const [x, y, z] = ranges(), aspect = ratio(x, y, z);
      return { xaxis: { ...side("x [m]"), range: x }, yaxis: { ...side("y [m]"), range: y }, zaxis: { ...side("z [m]"), range: z },
        aspectmode: "manual", aspectratio: aspect, camera: camera(aspect), dragmode: "orbit", domain: narrow() ? { y: [0.14, 1] } : { x: [0, 0.9] } };
    }
    const whole = () => ({ scene: scene(), margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", showlegend: false, modebar: bar(),
      font: { color: colour("text"), family: "system-ui, sans-serif" }, uirevision: "kept" });

    function show() {
      const frame = Number(time.value);
      timeText.value = `${told.axis} ${told.times[frame].toPrecision(4)} ${told.unit}`;
      factorText.value = `× ${magnification().toPrecision(3)}`;
      Plotly.react(box, all(frame), whole(), still);
      box.dataset.frame = String(frame);
      if (frame || playing) point(`${told.axis} [${told.unit}]`, told.times[frame], null);
    }
    let playing = 0;
    function step() {
      time.value = String((Number(time.value) + 1) % frames);
      show();
      playing = setTimeout(() => requestAnimationFrame(step), Math.max(40, 4000 / frames));
    }
    play.addEventListener("click", () => {
      if (playing) { clearTimeout(playing); playing = 0; play.textContent = "Play"; } else { play.textContent = "Pause"; step(); }
    });
    time.addEventListener("input", show);
    factor.addEventListener("input", show);
    shade?.addEventListener("change", show);
    drawn.push({ box, plot: null, again: show });
    show();
  }

  // ----- tables that sort

  const amount = (text) => { const found = parseFloat(text.replace(/[^0-9eE.+-]/g, "")); return Number.isNaN(found) ? null : found; };
  function sortable(table) {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((cell, column) => {
      const button = document.createElement("button");
      button.type = "button"; button.append(...cell.childNodes); cell.append(button);
      button.addEventListener("click", () => {
        const up = cell.getAttribute("aria-sort") !== "ascending";
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        cell.setAttribute("aria-sort", up ? "ascending" : "descending");
        const rows = [...table.tBodies[0].rows].map((row) => [row.cells[column].textContent, row]);
        const counted = rows.every(([text]) => amount(text) !== null || text.trim() === "-" || text.trim() === "");
        rows.sort(([a], [b]) => (counted ? (amount(a) ?? Infinity) - (amount(b) ?? Infinity) : a.localeCompare(b)) * (up ? 1 : -1));
        table.tBodies[0].append(...rows.map(([, row]) => row));
      });
    });
  }

  function start() {
    document.querySelectorAll("table").forEach((table) => { if (table.tBodies[0]?.rows.length > 2) sortable(table); });
    const draw = (box) => { // one that fails, for want of drawing in space say, keeps none of the others
      if (box.dataset.drawn) return;
      box.dataset.drawn = "1";
      try { (box.className === "view" ? drawView : drawPlot)(box); } catch (failure) {
        box.textContent = `This could not be drawn: ${failure.message}`;
        console.error(failure);
      }
    };
    const seen = new IntersectionObserver((entries) => {
      for (const entry of entries) if (entry.isIntersecting) { seen.unobserve(entry.target); draw(entry.target); }
    }, { rootMargin: "400px" });
    document.querySelectorAll(".plot, .view").forEach((box) => seen.observe(box));
    const redraw = () => drawn.forEach(({ box, plot, again }) => {
      if (again) again(); else Plotly.react(box, traces(plot), layout(plot), still);
    });
    addEventListener("beforeprint", () => {
      document.querySelectorAll("details").forEach((more) => { more.open = true; });
      document.querySelectorAll(".plot, .view").forEach(draw);
      if (dark.matches) { printing = true; redraw(); }
    });
    addEventListener("afterprint", () => { if (printing) { printing = false; redraw(); } });
    dark.addEventListener("change", redraw);
  }
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start); else start();
})();
