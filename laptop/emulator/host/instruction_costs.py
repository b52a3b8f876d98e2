"""Costs of the brick's Python, in thousands of instructions or single ones, counted on it.

Counted on CPython 3.5.3, built soft-float for an ARM926, in an emulated processor that counts; each
by itself, many times over.  `python -m tests.claims brick` holds what comes out of them against
counts of whole ticks, decisions and starts.
"""

import functools
from typing import Dict, List, Tuple

COSTS = {
    "local": 31,
    "closure": 42,
    "global": 112,
    "builtin": 182,
    "constant": 31,
    "attribute": 240,
    "module attribute": 248,
    "method": 393,
    "store": 34,
    "store global": 110,
    "store attribute": 347,
    "store item": 185,
    "pop": 27,
    "add": 208,
    "mixed": 900,
    "divide": 724,
    "whole": 400,
    "power": 5000,
    "negate": 90,
    "format": 900,
    "compare": 195,
    "compare with zero": 300,
    "is": 74,
    "in": 250,
    "truth": 60,
    "branch": 25,
    "item": 160,
    "slice": 800,
    "tuple": 175,
    "list": 360,
    "dict": 560,
    "per element": 23,
    "per pair": 120,
    "unpack": 65,
    "call": 150,
    "argument": 22,
    "keyword": 100,
    "star": 400,
    "function": 360,
    "create": 1800,
    "named tuple": 3560,
    "context manager": 14000,
    "return": 50,
    "loop": 120,
    "turn": 100,
    "list comprehension": 1850,
    "generator": 2000,
    "element": 165,
    "yielded": 420,
    "yield": 150,
    "def": 450,
    "lambda": 600,
    "class": 60000,
    "import": 2900,
    "raise": 1300,
    "handler": 500,
    "try": 100,
    "with": 1700,
    "delete": 60,
}
"""Costs of Python's steps, instructions."""

CALLS = {
    "abs": 50, "len": 30, "min": 1050, "max": 1050, "sum": 1350, "zip": 1450, "range": 1500,
    "enumerate": 1250, "isinstance": 380, "float": 550, "int": 850, "round": 3500, "sorted": 5000,
    "tuple": 800, "list": 1150, "dict": 1600, "set": 1500, "map": 2900, "any": 450, "all": 450,
    "ascii": 5000,
    "reversed": 900, "str": 3000, "repr": 4000, "getattr": 400, "hasattr": 400, "divmod": 900,
    "object": 300, "iter": 200, "next": 200, "open": 80000, "print": 6000, "bytes": 800,
    "math.cos": 2080, "math.sin": 1800, "math.tan": 3000, "math.atan2": 4800, "math.acos": 1400,
    "math.asin": 1400, "math.atan": 3000, "math.sqrt": 2560, "math.hypot": 5150, "math.exp": 2500,
    "math.log": 2000, "math.radians": 150, "math.degrees": 170, "math.isfinite": 165,
    "math.isnan": 165, "math.floor": 1170, "math.ceil": 1170, "math.copysign": 530,
    "math.fmod": 740, "math.fabs": 150, "math.pow": 5000,
    "os.path.join": 9500, "os.path.exists": 11500, "os.path.abspath": 21500,
    "os.path.dirname": 9500, "os.path.realpath": 50000, "os.environ.get": 14500,
    "gc.collect": 5000000, "collections.namedtuple": 1874000,
    "shared.record.record": 170000, "contextlib.suppress": 5000, "super": 1700,
    "collections.deque": 900, "hashlib.pbkdf2_hmac": 40600000, "hashlib.sha256": 5000,
    "hmac.new": 38000,
}  # fmt: skip
"""Cost of a call of these beside `call`, instructions."""

METHODS = {
    "append": 0, "pop": 300, "popleft": 100, "get": 350, "items": 200, "keys": 200, "values": 200,
    "join": 700, "split": 1200, "strip": 350, "decode": 700, "encode": 550, "startswith": 850,
    "endswith": 850, "format": 4500, "match": 2100, "search": 2500, "group": 500, "update": 1000,
    "extend": 700, "sort": 4500, "copy": 700, "insert": 300, "index": 400, "count": 400,
    "setdefault": 400, "replace": 1000, "lower": 500, "find": 500,
    "digest": 7500, "hexdigest": 3500,  # with the blocks of a message of usual length before it
    "seek": 900, "read": 1500, "write": 1500, "flush": 300, "add_subparsers": 140000,
}  # fmt: skip
"""Cost of a method of whatever object beside `call`, instructions."""

LIBRARY = {
    "argparse:ArgumentParser.__init__": (520, 0),
    "argparse:_ActionsContainer.add_argument": (108, 0),
    "argparse:_SubParsersAction.add_parser": (420, 0),
    "argparse:ArgumentParser.parse_known_args": (350, 0),
    "configparser:RawConfigParser.__init__": (545, 0),
    "configparser:RawConfigParser.read_file": (1700, 0),
    "configparser:RawConfigParser.get": (45, 0),
    "configparser:RawConfigParser.has_option": (12, 0),
    "configparser:RawConfigParser.options": (20, 0),
    "json.decoder:JSONDecoder.decode": (7, 0.22),
    "json.decoder:JSONDecoder.raw_decode": (2.5, 0.2),
    "json.encoder:JSONEncoder.encode": (18, 0.5),
}
"""Costs of functions of the library that are written in Python, thousand instructions: of each
call, and of each character of the text that it takes or gives."""

PATTERN = (150, 12)
"""Cost of a regular expression that is new, and of each of its characters, thousand
instructions."""

PROGRAM_FACTOR = 1.11
"""Factor of all costs in a whole program, beside those of single steps: fitted to ticks."""

START = 52000
"""Cost of the start of Python itself, thousand instructions."""

FOUND, LOADED = 180, 0.065
"""Cost of finding a module that is not of the library, and of loading each byte of its source,
compiled, thousand instructions."""

COMPILED = 0.93
"""Cost of a byte of the script itself, which is compiled in every run, thousand instructions."""

CLEARED = 0.12
"""Cost of clearing all modules at the end, as a share of the cost of loading them."""

_IMPORTS = """
_ast 8273; _bisect 70; _compat_pickle 855; _compression 664; _datetime 468; _json 131; _md5 88;
_pickle 453; _posixsubprocess 63; _pydecimal 17252 functools; _random 87; _sha1 382; _sha256 120;
_sha512 120; _socket 735; _sre 197; _string 67; _struct 204; argparse 5287 copy re textwrap
gettext; array 193; ast 725 _ast; atexit 72; base64 655 re struct binascii; binascii 251; bisect
326 _bisect; bz2 1636 _compression threading; calendar 2655 datetime locale; collections 5700
operator keyword heapq reprlib; configparser 12355 re functools; contextlib 997 functools; copy
1625 copyreg functools; copyreg 310; csv 1070 re; ctypes 1245; datetime 3068 time math _datetime;
decimal 1217 _pydecimal math numbers threading re locale; difflib 3637 re collections; dis 3874
opcode functools; email 231; email._encoded_words 927 re base64 binascii string email.errors
functools; email._parseaddr 630 time calendar; email._policybase 1201 email.header email.charset
email.utils; email.base64mime 284 base64 binascii; email.charset 1084 email.base64mime
email.quoprimime email.errors email.encoders functools; email.encoders 541 base64 quopri;
email.errors 2579; email.feedparser 3301 re email.errors email.message email._policybase;
email.header 3836 re binascii email.quoprimime email.base64mime email.errors email.charset;
email.iterators 260; email.message 3313 re uu quopri email.utils email.errors email._policybase
email.charset email._encoded_words email.iterators; email.parser 772 email.feedparser
email._policybase; email.quoprimime 1230 re string; email.utils 4696 re time random socket datetime
urllib urllib.parse email._parseaddr email.charset; enum 1475 functools; fcntl 130; fnmatch 302 re
functools; fractions 6154 decimal math numbers re; functools 3430 types weakref collections; gc
105; getopt 394 gettext; gettext 6969 locale copy re struct; glob 894 re fnmatch; grp 101; hashlib
2396 _md5 _sha1 _sha256 _sha512; heapq 870; hmac 896 hashlib; html 1960 re html.entities;
html.entities 4436; http 6344 enum; http.client 4664 email email.parser email.message re socket
urllib urllib.parse ssl; importlib.machinery 425 functools; inspect 22735 ast dis enum
importlib.machinery linecache re tokenize token; ipaddress 8199 functools; json 783 json.decoder
json.encoder; json.decoder 1596 re json.scanner _json; json.encoder 1932 re _json; json.scanner
1703 re _json; keyword 700; linecache 663 tokenize functools; locale 3731 re functools; logging
3333 time traceback string threading atexit; lzma 1009; math 148; ntpath 2362; numbers 1995; opcode
1852; operator 1580; pathlib 4574 fnmatch ntpath re contextlib urllib urllib.parse; pickle 4842
copyreg struct re _compat_pickle _pickle functools; platform 16720 re subprocess; pprint 804 re
functools; pwd 110; queue 2287 threading time; quopri 341 binascii; random 1105 math hashlib
_random functools; re 976 sre_compile sre_parse copyreg; reprlib 910; sched 2607 time threading;
select 162; selectors 3821 math select collections; shlex 848 re collections; shutil 4748 fnmatch
bz2 lzma pwd grp; signal 5159 enum; socket 8002 _socket selectors enum; socketserver 1934 socket
selectors threading time; sre_compile 1147 _sre sre_parse sre_constants; sre_constants 1313 _sre;
sre_parse 1345 sre_constants; ssl 3526 ipaddress textwrap re enum; statistics 899 math fractions
decimal; string 9722 _string re collections; struct 324 _struct; subprocess 2267 time signal
_posixsubprocess select selectors threading; tempfile 1173 shutil random; textwrap 7082 re;
threading 3754 time traceback; time 186; timeit 478 gc time; token 539; tokenize 5302 re token
collections; traceback 1179 linecache; types 1170 functools collections; unittest 1352
unittest.result unittest.case unittest.suite unittest.loader unittest.main unittest.runner
unittest.signals; unittest.case 4369 difflib logging pprint re contextlib traceback unittest.result
unittest.util; unittest.loader 2741 re traceback fnmatch unittest.case unittest.suite
unittest.util; unittest.main 749 argparse unittest.loader unittest.runner unittest.signals;
unittest.result 1059 traceback unittest.util; unittest.runner 1117 time unittest.result
unittest.signals; unittest.signals 370 signal; unittest.suite 770 unittest.case unittest.util;
unittest.util 2162 functools; urllib 177; urllib.error 753 urllib.response; urllib.parse 8532 re
collections; urllib.request 7094 base64 bisect email hashlib http http.client re socket string time
tempfile contextlib urllib.error urllib.parse urllib.response ssl; urllib.response 591 tempfile; uu
394 binascii; uuid 1251 ctypes; weakref 2260 collections
"""
"""Modules of the standard library that bare Python has not loaded yet: what each takes by itself,
thousand instructions, and what it imports."""


@functools.lru_cache(maxsize=1)
def imports() -> Dict[str, Tuple[int, List[str]]]:
    """Return {module: (thousand instructions, names that it imports)}."""
    rows = (row.split() for row in _IMPORTS.split(";"))
    return {name: (int(cost), others) for name, cost, *others in rows}
