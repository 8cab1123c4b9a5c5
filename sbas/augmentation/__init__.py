"""SBAS messages: from files to corrections and their variances over time."""

from sbas.augmentation.message_files import read_messages
from sbas.augmentation.messages import SbasMessages
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline

__all__ = ["CorrectionTimeline", "SbasMessages", "correction_timeline", "read_messages"]
