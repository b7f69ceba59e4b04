"""Pictures and reports of analysed bodies.

study = view.study("tree", vertices, template, ground)     # measure one body, or the frames of one
view.write_report([study], Path("out"))                    # report.html, report.json, report.npz and pictures
"""

from __future__ import annotations

from ..study.study import Fitted, Study, study
from .floor import draw_floor_view
from .html import page
from .picture import draw_picture
from .report import write_report
from .timeline import draw_timeline

__all__ = ["Fitted", "Study", "draw_floor_view", "draw_picture", "draw_timeline", "page", "study", "write_report"]
