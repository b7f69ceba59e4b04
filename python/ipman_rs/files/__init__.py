"""Files: which may be opened, JSON and YAML that anybody may have written, and writing that leaves whole files only."""

from .json_file import parse_json as parse_json
from .json_file import read_json as read_json
from .names import safe_names as safe_names
from .regular import read_bytes as read_bytes
from .regular import regular as regular
from .spreadsheet import cell as cell
from .whole import being_written as being_written
from .whole import write_whole as write_whole
from .yaml_file import parse_yaml as parse_yaml
from .yaml_file import read_yaml as read_yaml
