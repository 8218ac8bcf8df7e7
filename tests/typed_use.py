"""The packages as a typed program of a user sees them: mypy reads this file with them, nothing runs it.

What is misspelt is marked as an error, and a mark that finds none is an error itself (``warn_unused_ignores``).
"""

import erls
import fe_import

run = erls.simulate(erls.load_chain("robot.toml"))
run.position("tip", 0.1)
run.joint_angle("hip", 0.1)
run.positoin("tip", 0.1)  # type: ignore[attr-defined]
erls.simulate("robot.toml").positoin("tip", 0.1)  # type: ignore[attr-defined]
erls.load_run("robot.run.h5").positoin("tip", 0.1)  # type: ignore[attr-defined]
erls.simulat("robot.toml")  # type: ignore[attr-defined]
record = erls.load_chain("robot.toml").recrod  # type: ignore[attr-defined]
erls.stepper("robot.toml").stpe()  # type: ignore[attr-defined]
fe_import.reduce_link(fe_import.load_link("arm.toml")).frequencies_of()  # type: ignore[attr-defined]
