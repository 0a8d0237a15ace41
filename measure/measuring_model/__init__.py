"""The model that measures: a network, or a reading model that is regressed on what a network sees.

networks                it is opened here: shipped, of a folder, of a lake
reading_model           from features to winds      reading_model_folder    its files
window_features         what each window of a film shows: the network's summary and its wind, and
                        the picture's place
regression              ridge regression with neighbouring windows, chosen by cross-validation over
                        blocks of time
intervals               conformal intervals and draws from the errors of blocks that were left out
novelty                 whether a film is of the same flag, seen from the same place
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.measuring_model.networks import Network, gate_beside, network
    from measure.measuring_model.window_features import Features, Place

__getattr__ = lazy_exports(__name__, __file__)
