"""Damages files on purpose, reproducibly: a seeded generator says what happens to which part."""

import io
import json
import re
import struct
import zipfile
import zlib

import lz4.frame
import zstandard
from lxml import etree

NASTY = [
    "", " ", "0", "-1", "1", "2147483648", "-2147483649", "1e999", "-1e999", "nan", "inf", "1e308", "1e-320", "0x10",
    "9" * 5000,
    "1_000", "٣", "true", "yes", "9" * 400, "0." + "3" * 400, "a" * 70_000, "..", "../../../etc/passwd", "/dev/zero",
    "/etc/passwd", "file:///dev/zero", "http://localhost:1/x", "C:\\x", "x\u0000y", "ü€😀", "\u202e", "%00", "%2e%2e/x",
    "a.b.c", ".", "{}", "[", "\x1b[2J", "&amp;", "<x/>", "2.0", "99.9", "input", "output", "Real", "String", "rad",
]  # fmt: skip
BYTES = [
    b"\0", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"<", b">", b"&", b'"', b",", b"\n", b"\r", b"[", b"]" * 50,
    b"=", b"'", b"<!DOCTYPE x [<!ENTITY a 'b'>]>", b"&a;", b"<!--", b"<![CDATA[",
    b"\x80\x81", b"PK\x05\x06", b"\x89MCAP0\r\n",
    struct.pack("<Q", 2**63), struct.pack("<I", 2**32 - 1), b"\0" * 100,
]  # fmt: skip


def damage(data, random):
    """Return bytes with some of them changed, lost, doubled or inserted."""
    data = bytearray(data)
    for _ in range(random.choice([1, 1, 1, 2, 4, 16])):
        at, length = random.randrange(len(data) + 1), random.choice([1, 1, 2, 8, 100, 1000])
        kind = random.randrange(6)
        if kind == 0 and at < len(data):
            data[at] = random.randrange(256)
        elif kind == 1:
            del data[at : at + length]
        elif kind == 2:
            data[at:at] = data[at : at + length]
        elif kind == 3:
            data[at:at] = random.choice(BYTES)
        elif kind == 4:
            data[at : at + length] = bytes(random.randrange(256) for _ in range(min(length, 16)))
        else:
            data = data[:at]
    return bytes(data)


def xml(data, random):
    """Return an XML document with elements and attributes removed, doubled, moved, renamed and exchanged."""
    if random.random() < 0.2:
        return damage(data, random)
    root = etree.fromstring(data)
    for _ in range(random.choice([1, 1, 2, 3, 6])):
        elements = [e for e in root.iter() if isinstance(e.tag, str)]
        one, other = random.choice(elements), random.choice(elements)
        parent = one.getparent()
        kind = random.randrange(9)
        if kind == 0 and parent is not None:
            parent.remove(one)
        elif kind == 1 and parent is not None:
            copies = random.choice([1, 1, 2, 50])
            for _ in range(copies):
                parent.insert(random.randrange(len(parent) + 1), etree.fromstring(etree.tostring(one)))
        elif kind == 2 and other not in one.iter():
            other.append(one)
        elif kind == 3:
            one.tag = other.tag if random.random() < 0.8 else "{http://example.com}x"
        elif kind == 4:
            one.text = random.choice([t for t in NASTY if _writable(t)])
        else:
            _attribute(one, other, random)
    result = etree.tostring(
        root, xml_declaration=True, encoding=random.choice(["UTF-8"] * 8 + ["UTF-16", "ISO-8859-1"])
    )
    if random.random() < 0.02:
        result = b"<?xml version='1.0'?><!DOCTYPE x [<!ENTITY e SYSTEM 'file:///etc/passwd'>]>" + etree.tostring(root)
    return damage(result, random) if random.random() < 0.1 else result


def _writable(text):
    return not re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f]", text)


def _attribute(one, other, random):
    names = list(one.attrib)
    kind = random.randrange(5)
    if kind == 0 and names:
        del one.attrib[random.choice(names)]
    elif kind == 1 and names:
        one.set(random.choice([*other.attrib, "x", "version", "source"]), one.attrib.pop(random.choice(names)))
    elif kind == 2 and names and other.attrib:
        one.set(random.choice(names), random.choice(list(other.attrib.values())))
    elif kind == 3:
        one.set(random.choice([*names, *other.attrib, "unit"]), random.choice([t for t in NASTY if _writable(t)]))
    elif names:
        name = random.choice(names)
        one.set(name, one.get(name) + random.choice([" ", ".", "x", "e9", "/../.."]))


def table(data, random):
    """Return a CSV file with cells, rows and columns changed."""
    if random.random() < 0.3:
        return damage(data, random)
    rows = [line.split(",") for line in data.decode().splitlines()]
    for _ in range(random.choice([1, 1, 2, 5])):
        row = random.choice(rows)
        kind = random.randrange(5)
        if kind == 0 and len(rows) > 1:
            rows.remove(row)
        elif kind == 1:
            rows.insert(random.randrange(len(rows)), list(row))
        elif kind == 2 and row:
            del row[random.randrange(len(row))]
        elif kind == 3:
            row.insert(random.randrange(len(row) + 1), random.choice(NASTY))
        elif row:
            row[random.randrange(len(row))] = random.choice([*NASTY, *random.choice(rows), '"', '"a""b"', "=1+1"])
    return "\n".join(",".join(row) for row in rows).encode(random.choice(["utf-8"] * 9 + ["utf-16"]), "surrogatepass")


def toml(data, random):
    """Return a TOML file with keys and values changed."""
    if random.random() < 0.2:
        return damage(data, random)
    text = data.decode()
    values = [
        *NASTY[2:16],
        '"x"',
        "[]",
        "{}",
        "[[1.0, 2.0], [0.5, 1.0]]",
        "[[]]",
        "1979-05-27",
        "07:32:00",
        "true",
        "''",
    ]
    values += [
        '"' + "\\u001b[2J" + '"',
        "[" * 30 + "]" * 30,
        "[[1, 2, 3]]",
        '[["a", 1]]',
        "-0.0",
        "1e400",
        "9" * 30,
        '"/dev/zero"',
    ]
    for _ in range(random.choice([1, 1, 2, 4])):
        lines = text.splitlines()
        at = random.randrange(len(lines))
        kind = random.randrange(5)
        if kind == 0:
            del lines[at]
        elif kind == 1:
            lines.insert(random.randrange(len(lines)), lines[at])
        elif kind == 2 and "=" in lines[at]:
            lines[at] = lines[at].partition("=")[0] + "= " + random.choice(values)
        elif kind == 3 and "=" in lines[at]:
            other = random.choice([line for line in lines if "=" in line])
            lines[at] = other.partition("=")[0] + "=" + lines[at].partition("=")[2]
        else:
            lines.insert(
                at, random.choice(["[faults]", "[[inputs]]", "[parameters]", "x = 1", "inputs = 1", "[[faults]]"])
            )
        text = "\n".join(lines) or "x = 1"
    return text.encode()


def archive(data, random):
    """Return a zip archive with members lost, doubled, renamed and damaged."""
    if random.random() < 0.3:
        return damage(data, random)
    with zipfile.ZipFile(io.BytesIO(data)) as file:
        members = [[name, file.read(name)] for name in file.namelist()]
    for _ in range(random.choice([1, 1, 2])):
        member = random.choice(members)
        kind = random.randrange(5)
        if kind == 0 and len(members) > 1:
            members.remove(member)
        elif kind == 1:
            member[0] = random.choice(
                [*(m[0] for m in members), "../x", "/x", "states/7", "states/x", "a\\..\\b", "x" * 200]
            )
        elif kind == 2 and member[0].endswith(".json"):
            member[1] = _json(member[1], random)
        elif kind == 3:
            member[1] = member[1][: random.randrange(len(member[1]) + 1)]
        else:
            member[1] = damage(member[1], random)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        for name, content in members:
            if name not in file.namelist():
                file.writestr(zipfile.ZipInfo(name), content)
    return stream.getvalue()


def _json(data, random):
    try:
        content = json.loads(data)
    except ValueError:
        return damage(data, random)
    values = [None, -1, 2**70, 1e308, float("nan"), "x", [], {}, [[]], {"a": {}}, True, "1e999", [1, 2, 3]]
    while isinstance(content, dict) and content:
        holder, key = content, random.choice(list(content))
        while isinstance(holder[key], dict) and holder[key] and random.random() < 0.7:
            holder, key = holder[key], random.choice(list(holder[key]))
        if random.random() < 0.3:
            del holder[key]
        else:
            holder[key] = random.choice(values)
        break
    return json.dumps(content).encode()


_HEAD = struct.Struct("<BQ")
_CHUNK = 6


def mcap(data, random):
    """Return a log with records lost, doubled, exchanged and damaged, chunks with matching checksums among them."""
    if random.random() < 0.3:
        return damage(data, random)
    magic, records, at = data[:8], [], 8
    while at < len(data) - 8:
        opcode, length = _HEAD.unpack_from(data, at)
        records.append([opcode, data[at + 9 : at + 9 + length]])
        at += 9 + length
    for _ in range(random.choice([1, 1, 2, 4])):
        record = random.choice(records)
        kind = random.randrange(6)
        if kind == 0 and len(records) > 1:
            records.remove(record)
        elif kind == 1:
            records.insert(random.randrange(len(records)), list(record))
        elif kind == 2:
            record[0] = random.randrange(16)
        elif kind == 3 and record[0] == _CHUNK:
            record[1] = _chunk(record[1], random)
        else:
            record[1] = damage(record[1], random)
    body = b"".join(_HEAD.pack(opcode, len(content)) + content for opcode, content in records)
    return magic + body + random.choice([magic, magic, b""])


def _chunk(body, random):
    start, end, size, _, name = struct.unpack_from("<QQQII", body)
    if name > 4 or size > 1 << 24:
        return damage(body, random)
    compression, inner = body[32 : 32 + name], body[40 + name :]
    try:
        plain = {b"zstd": zstandard.decompress, b"lz4": lz4.frame.decompress, b"": bytes}[compression](inner)
    except Exception:  # damaged before
        return damage(body, random)
    plain = damage(plain, random)
    claimed = random.choice([len(plain)] * 5 + [0, 2**40, 2**63])
    return struct.pack("<QQQII", start, end, claimed, zlib.crc32(plain), 0) + struct.pack("<Q", len(plain)) + plain
