# SPDX-License-Identifier: GPL-3.0-or-later
"""Touch scenes of rigid and soft objects from Python.

    import hybrid
    import numpy as np

    with hybrid.Session("scene.toml") as s:
        path = np.linspace([0, 0, 0.04], [0, 0, 0.02], 1000)
        trace = s.play(path)
        print(trace.force_N[-1], trace.contact_count.max())

Units are SI: meters, newtons, seconds. Positions, forces and surfaces are in the scene's frame, and quaternions are
(w, x, y, z). The module calls the shared library libhybrid through its C interface (hybrid.h). The library works
without Python's lock, so other Python threads run meanwhile. A failed call raises hybrid.Error, whose text says what
was wrong, where, and what to do.
"""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Editable", "Error", "ForceError", "Object", "Session", "TRACE", "version"]

_ABI_VERSION = 2

#: One tick: a row of a trace. device_m, proxy_m: positions (m). force_N: on the hand, after the limits (N);
#: rigid_N, soft_N: parts of the force before the limits. contact_count: objects in contact. contact_bits: bit n is
#: object n.
#: faults: see Session.fault_texts(). tick_us: processor time (us). hash: of all forces so far.
TRACE = np.dtype(
    [
        ("size", "u4"),
        ("contact_count", "u4"),
        ("contact_bits", "u4"),
        ("faults", "u4"),
        ("device_m", "f8", 3),
        ("proxy_m", "f8", 3),
        ("force_N", "f8", 3),
        ("rigid_N", "f8", 3),
        ("soft_N", "f8", 3),
        ("tick_us", "f8"),
        ("tick", "u8"),
        ("hash", "u8"),
    ]
)

_ROW = np.dtype((np.record, TRACE))  # a row whose fields are attributes
_Row = ctypes.c_uint32 * (TRACE.itemsize // 4)  # memory of a row; its first word is the size

_RELAXATIONS = {"in-call": 0, "thread": 1, "tick": 2}


class _Struct(ctypes.Structure):
    """A structure of hybrid.h that begins with its size."""

    def __init__(self, **values: Any) -> None:
        super().__init__(ctypes.sizeof(type(self)), **values)


def _struct(name: str, *fields: tuple) -> type:
    return type(name, (_Struct,), {"_fields_": [("size", ctypes.c_uint32), *fields]})


_u32, _u64, _f64, _text = ctypes.c_uint32, ctypes.c_uint64, ctypes.c_double, ctypes.c_char_p
_Options = _struct(
    "_Options",
    ("relaxation", _u32),
    ("rate_hz", _f64),
    ("recorded_ticks", _u64),
    ("surfaces_hz", _f64),
    ("without_surfaces", _u32),
    ("with_error", _u32),
)
_Info = _struct(
    "_Info",
    ("objects", _u32),
    ("rigid_objects", _u32),
    ("notes", _u32),
    ("editable", _u32),
    ("is_punch", _u32),
    ("tool_radius_m", _f64),
    ("period_s", _f64),
    ("max_force_N", _f64),
    ("low_m", _f64 * 3),
    ("high_m", _f64 * 3),
)
_Object = _struct("_Object", ("is_soft", _u32), ("name", _text), ("vertices", _u64), ("triangles", _u64))
_Editable = _struct(
    "_Editable", ("object", _text), ("quantity", _text), ("in_scene", _f64), ("low", _f64), ("high", _f64)
)
_Snapshot = _struct(
    "_Snapshot",
    ("is_fresh", _u32),
    ("tick", _u64),
    ("device_m", _f64 * 3),
    ("proxy_m", _f64 * 3),
    ("force_N", _f64 * 3),
)
_ForceError = _struct(
    "_ForceError",
    ("samples", _u32),
    ("max_N", _f64),
    ("rms_N", _f64),
    ("max_jnd", _f64),
    ("p99_jnd", _f64),
    ("moving_max_jnd", _f64),
    ("still_max_jnd", _f64),
)


class Error(RuntimeError):
    """A refused call. `code` is its name in hybrid.h, such as "HYBRID_REFUSED"."""

    def __init__(self, code: str, text: str) -> None:
        super().__init__(text)
        self.code = code


def _candidates() -> list[str]:
    """Places of the library: HYBRID_LIBRARY, the folders above an installed module, the system's."""
    if given := os.environ.get("HYBRID_LIBRARY"):
        return [given]
    name = f"libhybrid.so.{_ABI_VERSION}"
    above = list(Path(__file__).resolve().parents)[:3]
    return [str(found) for folder in above for found in (folder / name, *folder.glob(f"*-linux-gnu/{name}"))
            if found.exists()] + [name]


def _load() -> ctypes.CDLL:
    name = _candidates()[0]
    try:
        library = ctypes.CDLL(name)
    except OSError as error:
        raise ImportError(
            f"{error}; install libhybrid, or set HYBRID_LIBRARY to the path of libhybrid.so"
        ) from error
    if library.hybrid_abi_version() != _ABI_VERSION:
        raise ImportError(
            f"{name}: this module needs version {_ABI_VERSION} of the interface, and the library has version "
            f"{library.hybrid_abi_version()}; install both from the same release"
        )
    for function in ("hybrid_version", "hybrid_error_text", "hybrid_code_name", "hybrid_fault_text"):
        getattr(library, function).restype = _text
    return library


_library = _load()
_vector = _f64 * 3


def _declare(name: str, *arguments: Any) -> None:
    getattr(_library, name).argtypes = arguments


_handle, _pointer = ctypes.c_void_p, ctypes.c_void_p
_declare("hybrid_open", _text, _pointer, _pointer)
_declare("hybrid_open_text", _text, _text, _pointer, _pointer)
_declare("hybrid_close", _handle)
_declare("hybrid_get_info", _handle, _pointer)
_declare("hybrid_get_object", _handle, _u32, _pointer)
_declare("hybrid_note", _handle, _u32, _pointer)
_declare("hybrid_begin", _handle, _pointer)
_declare("hybrid_tick", _handle, _pointer, _pointer, _f64, _pointer)
_declare("hybrid_play", _handle, _pointer, ctypes.c_size_t, _f64, _pointer)
_declare("hybrid_object_force", _handle, _u32, _pointer, _pointer)
_declare("hybrid_state_hash", _handle, _pointer)
_declare("hybrid_fault_text", _u32)
_declare("hybrid_editable_value", _handle, _u32, _pointer)
_declare("hybrid_edit", _handle, _text, _text, _f64)
_declare("hybrid_publish", _handle)
_declare("hybrid_take_snapshot", _handle, _pointer)
_declare("hybrid_vertices", _handle, _u32, _pointer, ctypes.c_size_t, _pointer)
_declare("hybrid_triangles", _handle, _u32, _pointer, ctypes.c_size_t)
_declare("hybrid_save_recording", _handle, _text)
_declare("hybrid_measure_error", _handle, _pointer)


def _need(code: int) -> None:
    if code != 0:
        raise Error(_library.hybrid_code_name(code).decode(), _library.hybrid_error_text().decode("utf-8", "replace"))


def _place(position: ArrayLike) -> ctypes.Array:
    """A position for the library: a ctypes array, whose address takes less time to get than a numpy array's."""
    shape = np.shape(position) if not isinstance(position, (tuple, list)) else (len(position),)
    if shape != (3,):
        raise Error("HYBRID_BAD_VALUE", f"a position has the shape {shape}; pass three numbers x, y, z in meters")
    return _vector(*position)


def version() -> str:
    """Version of the library, "major.minor.patch"."""
    return _library.hybrid_version().decode()


@dataclass(frozen=True)
class Object:
    """An object of the scene. vertices, triangles: of its surface."""

    name: str
    is_soft: bool
    vertices: int
    triangles: int


@dataclass(frozen=True)
class Editable:
    """A value that Session.edit() may change (SI). object is None for the tool."""

    object: Optional[str]
    quantity: str
    in_scene: float
    low: float
    high: float


@dataclass(frozen=True)
class ForceError:
    """Error of the tissue's force, in newtons and in just noticeable differences (the larger of 7 % and 0.04 N)."""

    samples: int
    max_N: float
    rms_N: float
    max_jnd: float
    p99_jnd: float
    moving_max_jnd: float
    still_max_jnd: float


class Session:
    """A scene that the caller touches: the simulated device, hand and path of the scene have no effect.

    scene: path of a .toml file; Session.from_text() takes a text.
    relaxation: how tissue away from the contact relaxes. "in-call" (default; as `hybrid run`: the same inputs give
        the same bits), "thread" (a thread of its own, for real time), or "tick" (by the budget of the scene).
    rate_hz: servo rate; None: that of the scene.
    record: greatest number of ticks that save_recording() and measure_error() can cover.
    surfaces: keep memory for surfaces(). error: keep memory for measure_error().
    Raises Error: the scene is refused, with file, line and remedy.
    """

    def __init__(
        self,
        scene: Union[str, os.PathLike],
        *,
        relaxation: str = "in-call",
        rate_hz: Optional[float] = None,
        record: int = 0,
        surfaces: bool = True,
        error: bool = False,
    ) -> None:
        options = self._options(relaxation, rate_hz, record, surfaces, error)
        self._open(lambda to: _library.hybrid_open(os.fsencode(scene), ctypes.byref(options), to))

    @classmethod
    def from_text(
        cls,
        text: str,
        folder: Union[str, os.PathLike] = ".",
        *,
        relaxation: str = "in-call",
        rate_hz: Optional[float] = None,
        record: int = 0,
        surfaces: bool = True,
        error: bool = False,
    ) -> Session:
        """A session of a scene's text; `folder`: the files that it names are relative to it."""
        self = cls.__new__(cls)
        options = cls._options(relaxation, rate_hz, record, surfaces, error)
        self._open(
            lambda to: _library.hybrid_open_text(text.encode(), os.fsencode(folder), ctypes.byref(options), to)
        )
        return self

    def __repr__(self) -> str:
        return f"<hybrid.Session: {len(self.objects)} objects, a tick every {1e3 * self.period_s:g} ms>"

    @staticmethod
    def _options(relaxation: str, rate_hz: Optional[float], record: int, surfaces: bool, error: bool) -> Any:
        if relaxation not in _RELAXATIONS:
            raise Error("HYBRID_BAD_VALUE", f"relaxation={relaxation!r} is unknown; use one of {list(_RELAXATIONS)}")
        return _Options(
            relaxation=_RELAXATIONS[relaxation],
            rate_hz=rate_hz or 0.0,
            recorded_ticks=record,
            without_surfaces=not surfaces,
            with_error=error,
        )

    def _open(self, opened: Any) -> None:
        handle = ctypes.c_void_p()
        self._handle = handle
        self._begun = False
        _need(opened(ctypes.byref(handle)))
        info = _Info()
        _need(_library.hybrid_get_info(handle, ctypes.byref(info)))
        #: Time between ticks (s), limit of the force on the hand (N), radius of the tool (m).
        self.period_s: float = info.period_s
        self.max_force_N: float = info.max_force_N
        self.tool_radius_m: float = info.tool_radius_m
        #: Box around all objects at rest (m), shape (3,).
        self.low_m: NDArray[np.float64] = np.array(info.low_m)
        self.high_m: NDArray[np.float64] = np.array(info.high_m)
        self.objects: list[Object] = [self._object(n) for n in range(info.objects)]
        self.notes: list[str] = [self._note(n) for n in range(info.notes)]
        self.editable: list[Editable] = [self._editable(n) for n in range(info.editable)]

    def _object(self, number: int) -> Object:
        found = _Object()
        _need(_library.hybrid_get_object(self._handle, number, ctypes.byref(found)))
        return Object(found.name.decode("utf-8", "replace"), bool(found.is_soft), found.vertices, found.triangles)

    def _note(self, number: int) -> str:
        text = _text()
        _need(_library.hybrid_note(self._handle, number, ctypes.byref(text)))
        return (text.value or b"").decode("utf-8", "replace")

    def _editable(self, number: int) -> Editable:
        found = _Editable()
        _need(_library.hybrid_editable_value(self._handle, number, ctypes.byref(found)))
        name = found.object.decode("utf-8", "replace") if found.object else None
        return Editable(name, found.quantity.decode(), found.in_scene, found.low, found.high)

    def close(self) -> None:
        """Frees the session. Later calls raise Error."""
        _need(_library.hybrid_close(self._handle))

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            _library.hybrid_close(self._handle)  # fails harmlessly if the session was closed before

    # ---- ticks ----

    def begin(self, position: ArrayLike) -> None:
        """Starts with the tool at a position (m), outside everything rigid. Without this call, the first tick() or
        play() starts at its own first position."""
        at = _place(position)
        _need(_library.hybrid_begin(self._handle, at))
        self._begun = True

    def tick(
        self, position: ArrayLike, dt: Optional[float] = None, orientation: Optional[Sequence[float]] = None
    ) -> np.record:
        """One tick with the tool at a position (m); returns a row of TRACE, such as row.force_N of shape (3,).

        dt: time since the tick before (s), 0 to 0.1; None: the session's period. orientation: a unit quaternion
        (w, x, y, z); it is checked, and has no effect on a ball or a punch."""
        at = _place(position)
        if not self._begun:
            self.begin(tuple(at))
        turned = (_f64 * 4)(*orientation) if orientation is not None else None
        row = _Row(TRACE.itemsize)
        _need(_library.hybrid_tick(self._handle, at, turned, self._dt(dt), row))
        return np.frombuffer(row, _ROW)[0]

    def play(self, positions: ArrayLike, dt: Optional[float] = None) -> np.recarray:
        """A tick for each of the positions (m), shape (n, 3); returns the trace, shape (n,) of TRACE.

        Columns are views without copies: trace.force_N has the shape (n, 3). dt as in tick(). A float64 array in C
        order is not copied."""
        path = np.ascontiguousarray(positions, dtype=np.float64)
        if path.ndim != 2 or path.shape[1] != 3:
            raise Error("HYBRID_BAD_VALUE", f"the positions have the shape {path.shape}; pass (n, 3) in meters")
        trace = np.empty(len(path), TRACE)
        if len(path) == 0:
            return trace.view(np.recarray)
        if not self._begun:
            self.begin(path[0])
        trace["size"][0] = TRACE.itemsize
        _need(_library.hybrid_play(self._handle, path.ctypes.data, len(path), self._dt(dt), trace.ctypes.data))
        return trace.view(np.recarray)

    def _dt(self, dt: Optional[float]) -> float:
        return self.period_s if dt is None else dt

    def object_force(self, name: str) -> NDArray[np.float64]:
        """One object's part of the force (N) in the last tick, shape (3,)."""
        force = np.empty(3)
        _need(_library.hybrid_object_force(self._handle, self._number(name), force.ctypes.data, None))
        return force

    def _number(self, name: str) -> int:
        for number, item in enumerate(self.objects):
            if item.name == name:
                return number
        names = ", ".join(item.name for item in self.objects)
        raise Error("HYBRID_NOT_FOUND", f"there is no object {name!r}; there are: {names}")

    def state_hash(self) -> int:
        """Hash of all forces and of the state: `state_hash` of `hybrid run`."""
        value = _u64()
        _need(_library.hybrid_state_hash(self._handle, ctypes.byref(value)))
        return value.value

    @staticmethod
    def fault_texts(faults: int) -> list[str]:
        """The faults of a row of TRACE in words, each with its remedy."""
        bits = (1 << bit for bit in range(32) if int(faults) >> bit & 1)
        return [_library.hybrid_fault_text(bit).decode() for bit in bits]

    # ---- edits, surfaces, recordings ----

    def edit(self, quantity: str, value: float, object: Optional[str] = None) -> None:
        """Sets a value of `editable` (SI) before the next tick. object: None for the tool."""
        name = None if object is None else object.encode()
        _need(_library.hybrid_edit(self._handle, name, quantity.encode(), value))

    def surfaces(self) -> list[NDArray[np.float64]]:
        """The present vertices (m) of each object's surface, shape (vertices, 3)."""
        if self._begun:
            _need(_library.hybrid_publish(self._handle))
        _need(_library.hybrid_take_snapshot(self._handle, ctypes.byref(_Snapshot())))
        return [self._vertices(number) for number in range(len(self.objects))]

    def _vertices(self, number: int) -> NDArray[np.float64]:
        vertices = np.empty((self.objects[number].vertices, 3))
        _need(_library.hybrid_vertices(self._handle, number, vertices.ctypes.data, len(vertices), None))
        return vertices

    def triangles(self, name: str) -> NDArray[np.uint32]:
        """Triangles of an object's surface, shape (triangles, 3): indices of vertices. They never change."""
        number = self._number(name)
        corners = np.empty((self.objects[number].triangles, 3), np.uint32)
        _need(_library.hybrid_triangles(self._handle, number, corners.ctypes.data, len(corners)))
        return corners

    def save_recording(self, file: Union[str, os.PathLike]) -> None:
        """Writes the session so far: `hybrid replay FILE` plays it to the same hash. Needs record=."""
        _need(_library.hybrid_save_recording(self._handle, os.fsencode(file)))

    def measure_error(self) -> ForceError:
        """The error of the tissue's force so far. The reference is the same motion, five times slower, and ten times
        slower while the device is still. Takes about twice as long as the session. Needs record= and error=True."""
        found = _ForceError()
        _need(_library.hybrid_measure_error(self._handle, ctypes.byref(found)))
        return ForceError(**{name: getattr(found, name) for name, _ in _ForceError._fields_[1:]})
