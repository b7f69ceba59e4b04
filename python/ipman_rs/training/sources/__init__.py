"""Where training samples come from.

images     frames of a data set with their images      people    built people, seen as keypoints
mixture    several sources in given shares, drawn by number, so that a run can stop and go on at any step
"""

from .images import Images
from .mixture import Mixture, Share
from .people import People
from .source import BadSample, Source

__all__ = ["BadSample", "Images", "Mixture", "People", "Share", "Source"]
