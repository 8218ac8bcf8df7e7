from .identify.identify import identify as identify
from .inverse.invert import invert as invert
from .linear.linearize import linearize as linearize
from .optimization.optimize import optimize as optimize
from .run.chain.run import ChainRun as ChainRun
from .run.file import load_run as load_run
from .run.file import save_run as save_run
from .run.record import Run as Run
from .run.recovery import section_forces as section_forces
from .run.recovery import stress as stress
from .scene.chain import Scene as Scene
from .scene.made import make_scene as make_scene
from .scene.made import save_scene as save_scene
from .scene.read import load_chain as load_chain
from .scene.read import load_scene as load_scene
from .sensitivity.sensitivities import sensitivities as sensitivities
from .simulation.batch import simulate_many as simulate_many
from .simulation.simulate import simulate as simulate
from .simulation.stepper import stepper as stepper
from .studies.sweep.sweep import sweep as sweep
from .tracking.plan import plan as plan
from .view import show as show
from .view import write_view as write_view

__version__: str
