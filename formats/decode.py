"""Bytes of one channel -> ROS messages, with rosbags' generated deserialisers.

Every channel is decoded with the definition that stands in its own file and under its own name, so two recordings
whose types of the same name differ never meet. Where the file has no definition, or one that cannot be parsed, the
definitions of ROS distributions are tried; a wrong one is noticed, because sizes then do not agree.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from typing import Any

from .containers.container import Channel

Decoder = Callable[[bytes | memoryview], Any]

ENCODINGS = ("cdr", "ros1", "json", "file")
_FALLBACK_DISTROS = ("humble", "jazzy")


def why_not_decodable(channel: Channel) -> str:
    """Return why no decoder exists for a channel, or an empty string."""
    if channel.encoding not in ENCODINGS:
        return f"encoding {channel.encoding!r} is not supported"
    if channel.encoding in ("cdr", "ros1") and not channel.type:
        return "the channel has no type"
    return ""


def decoder_for(channel: Channel) -> Decoder:
    """Return the function that makes a message of the channel's bytes.

    Raises:
        ValueError: the type is neither defined in the file nor by ROS.
    """
    if channel.encoding == "json":
        return _decode_json
    if channel.encoding == "file":
        return bytes
    return _ros_decoder(channel.type, channel.encoding, channel.definition, channel.definition_format, channel.distro)


def _decode_json(data: bytes | memoryview) -> Any:
    return json.loads(bytes(data))


@lru_cache(maxsize=256)
def _ros_decoder(ros_type: str, encoding: str, definition: str, definition_format: str, distro: str) -> Decoder:
    stores = _stores(ros_type, encoding, definition, definition_format, distro)
    if not stores:
        raise ValueError(f"type {ros_type!r} is not defined in the file")
    method = "deserialize_ros1" if encoding == "ros1" else "deserialize_cdr"
    functions = [getattr(store, method) for store in stores]

    def decode(data: bytes | memoryview) -> Any:
        try:
            return functions[0](data, ros_type)
        except Exception as err:
            for function in functions[1:]:
                with suppress(Exception):
                    return function(data, ros_type)
            raise err from None

    return decode


def _stores(ros_type: str, encoding: str, definition: str, definition_format: str, distro: str) -> list[Any]:
    """Return the typestores to try in order; the file's own first."""
    own = _own_store(ros_type, definition, definition_format) if definition.strip() else None
    names = ("ros1_noetic",) if encoding == "ros1" else tuple(f"ros2_{d}" for d in (distro, *_FALLBACK_DISTROS) if d)
    known = [store for name in dict.fromkeys(names) if (store := _store_of(name)) and ros_type in store.types]
    if own is None and not known and definition_format:
        # A message without fields has an empty definition.
        own = _own_store(ros_type, definition, definition_format)
    return known if own is None else [own, *known]


def _own_store(ros_type: str, definition: str, definition_format: str) -> Any:
    """Return a typestore with the file's definitions, or None when they cannot be used."""
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    try:
        types: dict[str, Any] = {}
        separator = "=" * 80 + "\n"
        if definition_format == "ros2idl":
            if definition.startswith(f"{separator}IDL: "):
                for part in definition.split(separator)[1:]:
                    types.update(get_types_from_idl(part.split("\n", 1)[1]))
            else:
                types.update(get_types_from_idl(definition))
        else:
            types.update(get_types_from_msg(definition, ros_type))
        store = get_typestore(Stores.EMPTY)
        store.register(types)
        store.get_msgdef(ros_type)
    except Exception:  # noqa: BLE001  # the parser throws anything; the caller falls back
        return None
    return store


@lru_cache(maxsize=8)
def _store_of(name: str) -> Any:
    from rosbags.typesys import Stores, get_typestore

    try:
        return get_typestore(Stores(name))
    except ValueError:
        return None
