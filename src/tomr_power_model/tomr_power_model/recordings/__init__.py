"""Reading and writing rosbag2 recordings (mcap or sqlite3) without ROS."""

from tomr_power_model.recordings.reader import Recording, open_recording
from tomr_power_model.recordings.topics import require_topic, resolve_topic
from tomr_power_model.recordings.writer import RecordingWriter

__all__ = [
    "Recording",
    "RecordingWriter",
    "open_recording",
    "require_topic",
    "resolve_topic",
]
