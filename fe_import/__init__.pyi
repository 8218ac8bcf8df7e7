from .derivatives import modal_derivatives as modal_derivatives
from .description.link import load_link as load_link
from .modal.file import read_modal_file as read_modal_file
from .modal.file import write_modal_file as write_modal_file
from .modal.model import ModalModel as ModalModel
from .reduce import reduce_link as reduce_link
from .scikit_fem import link_from_skfem as link_from_skfem
