"""Names and layouts of messages: fields, tags and topics."""

import re

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from hypothesis import given, settings
from hypothesis import strategies as st
from log_samples import AWKWARD, read_by_mcap, table

from twip.cosim.log.log_schema import PLAIN_TYPES, WIRES, descriptor, field_numbers, layout, topics, unique_identifiers
from twip.cosim.model.signals import Channel, Signal
from twip.cosim.sinks.mcap_log import McapLog


@pytest.mark.parametrize("count", [1, 15, 16, 300, 2050])
def test_tags_of_every_length(tmp_path, count):
    """Field numbers from 16 on take two bytes, from 2048 on three."""
    kinds = list(PLAIN_TYPES.values())
    described = [Channel("plant", tuple(Signal(f"v{i}", kinds[i % 7 % 3], None, "output") for i in range(count)))]
    times, rows = table(described, 9)
    with McapLog(tmp_path / "a.mcap", described, {}) as log:
        log.write(times, rows)
    bits, _, _ = read_by_mcap(tmp_path / "a.mcap", described)
    assert np.array_equal(bits, rows.view(np.uint64))


@given(st.lists(st.sampled_from(sorted(WIRES)), max_size=60))
def test_layout_is_what_protobuf_writes(kinds):
    """Protobuf's own serialisation of ones (it leaves out zeros) puts each value where the layout says."""
    signals = [Signal(f"v{i}", kind, None, "output") for i, kind in enumerate(kinds)]
    message_class = _message_class(descriptor("m", signals), "twip.m")
    expected = layout(field_numbers(len(kinds)), kinds)
    data = bytearray(expected.template)
    for kind, offset in zip(kinds, expected.offsets, strict=True):
        one = np.array(1, WIRES[kind].dtype).tobytes()
        data[offset : offset + len(one)] = one
    assert message_class(**{s.name: 1 for s in signals}).SerializeToString(deterministic=True) == bytes(data)


def test_field_numbers_avoid_those_protobuf_keeps():
    numbers = field_numbers(19500)
    assert numbers[18998:19000] == [18999, 20000]
    assert len({*numbers}) == 19500
    signals = [Signal(f"v{i}", "Boolean", None, "output") for i in range(19001)]
    _message_class(descriptor("m", signals), "twip.m")


NAMES = st.lists(
    st.one_of(
        st.text(st.characters(codec="utf-8"), max_size=6),
        st.text("aAbB_.1[]", min_size=1, max_size=5),
        st.sampled_from([*AWKWARD, "a_b_2", "ab", "DESCRIPTOR", "None", "__proto__"]),
    ),
    unique=True,
    max_size=25,
)


@settings(max_examples=300)
@given(NAMES)
def test_field_names_are_valid_and_distinct_even_as_json_names(names):
    found = unique_identifiers(names)
    assert len(found) == len(names)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) for name in found)
    # Camel case as protobuf makes it, and lower case without underscores, which its libraries before 2023 compare.
    camel = {re.sub(r"_+(.?)", lambda m: m[1].upper(), name) for name in found}
    assert len(camel) == len({name.replace("_", "").lower() for name in found}) == len(names)
    assert found == unique_identifiers(names)


@given(NAMES)
def test_protobuf_takes_the_field_names(names):
    signals = [Signal(name, "Real", None, "output") for name in names]
    message_class = _message_class(descriptor("m", signals), "twip.m")
    assert [field.name for field in message_class.DESCRIPTOR.fields] == unique_identifiers(names)


@given(st.lists(st.from_regex(r"[A-Za-z][A-Za-z0-9]{0,5}", fullmatch=True), unique_by=str.lower))
def test_plain_names_stay(names):
    assert unique_identifiers(names) == names


def test_names_that_are_identifiers_keep_theirs():
    assert unique_identifiers(["a.b", "a_b", "left.voltage", "1st", "θ"]) == [
        "a_b_2",
        "a_b",
        "left_voltage",
        "x1st",
        "x_",
    ]


@given(st.lists(st.text("ab./", max_size=4) | st.sampled_from(["", "log", "system", "log_2"]), unique=True))
def test_topics_are_distinct_and_do_not_depend_on_the_order(components):
    found = topics(components)
    assert len({*found.values(), "/log"}) == len(components) + 1
    assert found == topics(reversed(components))
    assert "" not in found or found[""] == "/system"


def _message_class(data: bytes, name: str) -> type:
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(data).file:
        pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName(name))
