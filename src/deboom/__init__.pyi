from . import plot as plot
from .compressor.identify import identify as identify
from .compressor.unbalance import unbalance as unbalance
from .errors import InputError as InputError
from .explore.front import verify as verify
from .explore.robust import RobustResponse as RobustResponse
from .explore.search import RobustProblem as RobustProblem
from .explore.space import DesignSpace as DesignSpace
from .explore.space import ResponseFunction as ResponseFunction
from .files.campaign import read_campaign as read_campaign
from .files.inertance_test import read_inertance_test as read_inertance_test
from .files.operating_test import read_operating_test as read_operating_test
from .files.uff import read_uff as read_uff
from .measurement.modal import modal_model as modal_model
from .measurement.modal import pole_clusters as pole_clusters
from .measurement.modal import poles_over_orders as poles_over_orders
from .measurement.order_tracking import tracked_run as tracked_run
from .measurement.path_forces import blocked_forces_in_situ as blocked_forces_in_situ
from .measurement.path_forces import forces_by_inversion as forces_by_inversion
from .measurement.path_forces import (
    forces_by_mount_stiffness as forces_by_mount_stiffness,
)
from .measurement.virtual_point import virtual_point as virtual_point
from .mounts.characterise import characterise as characterise
from .mounts.library import open_library as open_library
from .mounts.response_surface import (
    DynamicStiffnessSurface as DynamicStiffnessSurface,
)
from .mounts.response_surface import compare_models as compare_models
from .notebook import booming_model as booming_model
from .notebook import correlation as correlation
from .notebook import design_space as design_space
from .notebook import doe as doe
from .notebook import morris as morris
from .notebook import read_platform as read_platform
from .notebook import robust_response as robust_response
from .notebook import search as search
from .notebook import sobol as sobol
from .physics.elastic_centre import ElasticCentre as ElasticCentre
from .physics.sound_level import spl as spl
from .study.platform_model import check_platform as check_platform
from .vehicles.booming_model import BoomingModel as BoomingModel
from .vehicles.path_analysis import analyse_paths as analyse_paths

__version__: str
