"""Every room's formula in plain, vectorised torch: the oracle of the tests, and the path of tensors on other devices.

Functions take `Posed(vertices, template)`, vertices (B, V, 3), and a ground, one or one a body; autograd differentiates
them twice. `evaluate` finds them by quantity name, as the compiled ops do.
"""

from . import skinning as skinning
from .balance import balance_cost as balance_cost
from .closing_volume import part_volumes as part_volumes
from .ground import ground_loss as ground_loss
from .mass import center_of_mass as center_of_mass
from .mass import mass_properties as mass_properties
from .posed import Posed as Posed
from .pressure import center_of_pressure as center_of_pressure
from .pressure import pressure as pressure
from .quantities import FORMULAS as FORMULAS
from .quantities import evaluate as evaluate
from .sampling import sample_surface as sample_surface
from .self_contact import self_contact_loss as self_contact_loss
from .stability import stability_loss as stability_loss
from .support import support_margin as support_margin
