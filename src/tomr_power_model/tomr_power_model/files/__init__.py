"""Reading what is not trusted within limits, and writing whole files or none."""

from tomr_power_model.files.arrays import read_arrays
from tomr_power_model.files.paths import real_path
from tomr_power_model.files.text import read_text, require_regular
from tomr_power_model.files.write import make_folder, write_bytes, write_text, write_together
from tomr_power_model.files.yaml_text import load_yaml, plain_yaml

__all__ = [
    "load_yaml",
    "make_folder",
    "plain_yaml",
    "read_arrays",
    "read_text",
    "real_path",
    "require_regular",
    "write_bytes",
    "write_text",
    "write_together",
]
