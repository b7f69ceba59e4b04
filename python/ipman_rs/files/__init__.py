"""Files: which may be opened, safe readers of untrusted JSON and YAML, and atomic writing."""

from .json_file import parse_json as parse_json
from .json_file import read_json as read_json
from .names import path_list as path_list
from .names import safe_names as safe_names
from .regular import read_bytes as read_bytes
from .regular import regular_file as regular_file
from .spreadsheet import cell as cell
from .whole import atomic_write as atomic_write
from .whole import write_whole as write_whole
from .yaml_file import parse_yaml as parse_yaml
from .yaml_file import read_yaml as read_yaml
