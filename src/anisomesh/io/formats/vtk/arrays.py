"""Arrays of VTK's XML files: text, base64 or raw bytes, compressed or not.

Format: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html.
"""

from __future__ import annotations

import base64
import lzma
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from anisomesh.io.formats.words import text_of

_TYPES = {
    **{f"Int{8 * n}": f"i{n}" for n in (1, 2, 4, 8)},
    **{f"UInt{8 * n}": f"u{n}" for n in (1, 2, 4, 8)},
    **{f"Float{8 * n}": f"f{n}" for n in (4, 8)},
}
_BLOCK_BYTES = 2**20  # of a block that is compressed by itself
_SEGMENT = re.compile(rb"[^=]+=*")  # base64 up to its padding
_LZ4_SHORTEST = 4  # bytes of a match


def _inflate(data: bytes, size: int) -> bytes:
    return zlib.decompressobj().decompress(data, size)


def _unpack_lzma(data: bytes, size: int) -> bytes:
    return lzma.LZMADecompressor().decompress(data, size)


def _unpack_lz4(data: bytes, size: int) -> bytes:
    """Return the content of a block of LZ4: https://github.com/lz4/lz4/blob/dev/doc/lz4_Block_format.md."""

    def length(total: int, at: int) -> tuple[int, int]:
        more = total == 15
        while more:
            total, more, at = total + data[at], data[at] == 255, at + 1
        return total, at

    out, at = bytearray(), 0
    while at < len(data) and len(out) <= size:
        token = data[at]
        literals, at = length(token >> 4, at + 1)
        out += data[at : at + literals]
        at += literals
        if at >= len(data):
            break
        back = int.from_bytes(data[at : at + 2], "little")
        count, at = length(token & 15, at + 2)
        count += _LZ4_SHORTEST
        if not 0 < back <= len(out) or len(out) + count > size:
            raise ValueError("malformed: a block compressed with LZ4 refers to bytes outside of it")
        repeated = bytes(out[len(out) - back :])
        out += (repeated * (count // back + 1))[:count]
    return bytes(out)


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {
    "vtkZLibDataCompressor": _inflate,
    "vtkLZMADataCompressor": _unpack_lzma,
    "vtkLZ4DataCompressor": _unpack_lz4,
}


@dataclass(frozen=True, kw_only=True)
class ArrayReader:
    """Reads the arrays of a file.

    Attributes
    ----------
    order
        Byte order, ``"<"`` or ``">"``.
    header
        NumPy type of the numbers of bytes.
    compressor
        Name of the compressor, empty for none.
    appended
        The bytes of the section of appended data behind its underscore.
    in_base64
        Whether these are base64.
    offsets
        Where arrays begin in them, sorted.
    """

    order: str
    header: np.dtype[Any]
    compressor: str
    appended: bytes = b""
    in_base64: bool = False
    offsets: list[int] = field(default_factory=list)

    def read(self, element: Element) -> npt.NDArray[Any]:
        """Return the numbers or strings of an array, flat.

        Raises
        ------
        ValueError
            If the type, the format or the compressor is unknown, or data are missing.
        """
        name, kind = element.get("Name", "without a name"), element.get("type", "")
        if kind == "String":
            return _strings(self._numbers(element, name, "UInt8"))
        if kind not in _TYPES:
            raise ValueError(f"the array {name} is of type {kind!r}; expected one of {', '.join(_TYPES)}")
        return self._numbers(element, name, kind)

    def _numbers(self, element: Element, name: str, kind: str) -> npt.NDArray[Any]:
        match element.get("format", "ascii"):
            case "ascii":
                parse = float if kind.startswith("Float") else int
                return np.array([parse(word) for word in (element.text or "").split()], dtype=_TYPES[kind])
            case "binary":
                data = self._unpacked(_from_base64((element.text or "").encode()), name)
            case "appended":
                data = self._unpacked(self._appended_at(element.get("offset", "")), name)
            case other:
                raise ValueError(f"the array {name} has the format {other!r}; expected ascii, binary or appended")
        if len(data) % np.dtype(_TYPES[kind]).itemsize:
            raise ValueError(f"malformed: the array {name} has {len(data)} bytes, not whole numbers")
        return np.frombuffer(data, dtype=self.order + _TYPES[kind])

    def _appended_at(self, offset: str) -> bytes:
        if not offset.isdigit() or int(offset) > len(self.appended):
            raise ValueError(f"truncated: an array begins at byte {offset[:20]!r} of {len(self.appended)} appended")
        if not self.in_base64:
            return self.appended[int(offset) :]
        following = [place for place in self.offsets if place > int(offset)]
        return _from_base64(self.appended[int(offset) : following[0] if following else None])

    def _unpacked(self, data: bytes, name: str) -> bytes:
        """Return the bytes of an array behind its header."""
        width = self.header.itemsize
        if not self.compressor:
            size = self._counts(data, 1, name)[0]
            if len(data) < width + size:
                raise ValueError(f"truncated: the array {name} declares {size} bytes but {len(data) - width} follow")
            return data[width : width + size]
        if self.compressor not in _UNPACK:
            raise ValueError(f"it is compressed with {self.compressor}; save it with ZLib or without compression")
        unpack = _UNPACK[self.compressor]
        n_blocks, block, last = (0, 0, 0) if not data else self._counts(data, 3, name)
        sizes = self._counts(data, 3 + n_blocks, name)[3:] if n_blocks else []
        at, parts = (3 + n_blocks) * width, []
        for k, size in enumerate(sizes):
            whole = last if last and k == n_blocks - 1 else block
            parts.append(unpack(data[at : at + size], whole) if whole else b"")
            at += size
            if at > len(data) or len(parts[-1]) != whole:
                raise ValueError(f"truncated: block {k} of the array {name} has less than {whole} bytes")
        return b"".join(parts)

    def _counts(self, data: bytes, count: int, name: str) -> list[int]:
        if count * self.header.itemsize > len(data):
            raise ValueError(f"truncated: the array {name} has a header of {count} numbers in {len(data)} bytes")
        numbers: list[int] = np.frombuffer(data, dtype=self.header, count=count).tolist()
        return numbers


def _strings(codes: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return strings, each ended by a zero, decoded as :func:`~anisomesh.io.formats.words.text_of` does."""
    words = codes.astype(np.uint8).tobytes().split(b"\0")
    if words[-1]:
        raise ValueError("truncated: its last string does not end")
    return np.array([text_of(word) for word in words[:-1]], dtype=np.str_)


def string_codes(words: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Return strings as bytes of UTF-8, each ended by a zero."""
    return np.frombuffer(b"".join(str(word).encode().replace(b"\0", b" ") + b"\0" for word in words.ravel()), np.uint8)


def _from_base64(text: bytes) -> bytes:
    """Return what base64 stands for; header and data may be encoded one after the other."""
    text = b"".join(text.split())
    if b"=" not in text[:-2]:
        return base64.b64decode(text, validate=True)
    return b"".join(base64.b64decode(part, validate=True) for part in _SEGMENT.findall(text))


def packed_array(values: npt.NDArray[Any]) -> str:
    """Return an array as compressed base64, with a header of 64-bit numbers."""
    data = values.astype(values.dtype.newbyteorder("<")).tobytes()
    blocks = [data[k : k + _BLOCK_BYTES] for k in range(0, len(data), _BLOCK_BYTES)]
    packed = [zlib.compress(block) for block in blocks]
    header = [len(blocks), _BLOCK_BYTES, len(data) % _BLOCK_BYTES, *map(len, packed)]
    return (base64.b64encode(np.array(header, dtype="<u8").tobytes()) + base64.b64encode(b"".join(packed))).decode()


def type_name(values: npt.NDArray[Any]) -> str:
    """Return VTK's name of the type of an array."""
    return next(name for name, kind in _TYPES.items() if values.dtype == np.dtype(kind))
