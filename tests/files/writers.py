# SPDX-License-Identifier: MIT
"""Text tables, compressed files, workbooks and MAT files, from arrays."""
import gzip
import io
import struct
import zipfile

import numpy as np


def numbers(values, form="%.6g", comma=False):
    """The values as text, with a decimal comma where asked."""
    text = (form + "\n") * len(values) % tuple(np.asarray(values).tolist())
    return (text.replace(".", ",") if comma else text).split("\n")[:-1]


def grouped(values, digits=3, thousands=".", decimal=","):
    """1234.5 as 1.234,500 (or 1,234.500)."""
    swap = str.maketrans({",": thousands, ".": decimal})
    return [f"{v:,.{digits}f}".translate(swap) for v in values]


def table(columns, names=None, separator=",", end="\n", preamble=(), units=None, last_end=True):
    """Lines of a text table. columns: lists of text of one length; names and units: rows above them, or nothing."""
    lines = list(preamble)
    for row in (names, units):
        if row is not None:
            lines.append(separator.join(row))
    lines += [separator.join(row) for row in zip(*columns)]
    return end.join(lines) + (end if last_end else "")


def clock(seconds, digits=3):
    """HH:MM:SS.fff of seconds since midnight."""
    scale = 10**digits
    whole = [int(round(s * scale)) for s in seconds]
    return [f"{w // scale // 3600:02d}:{w // scale // 60 % 60:02d}:{w // scale % 60:02d}.{w % scale:0{digits}d}" for w in whole]


def minutes(seconds, digits=3):
    """MM:SS.fff, the minutes of a run counted on."""
    scale = 10**digits
    whole = [int(round(s * scale)) for s in seconds]
    return [f"{w // scale // 60:02d}:{w // scale % 60:02d}.{w % scale:0{digits}d}" for w in whole]


def compressed(text):
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb", mtime=0, compresslevel=6) as file:
        file.write(text.encode() if isinstance(text, str) else text)
    return packed.getvalue()


def workbook(names, columns):
    """The least that is an Office Open XML workbook: one sheet, names in its first row."""
    def cell(value):
        if isinstance(value, str):
            return f'<c t="inlineStr"><is><t>{value}</t></is></c>'
        return f"<c><v>{value:.8g}</v></c>"
    rows = [names, *zip(*(c.tolist() for c in columns))]
    sheet = "".join(f'<row r="{k}">' + "".join(map(cell, row)) + "</row>" for k, row in enumerate(rows, 1))
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    kind = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    types = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    head = '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>\n'
    related = head + '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">{}</Relationships>'
    parts = {
        "[Content_Types].xml":
            head + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
            '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
            f'<Override PartName="/xl/workbook.xml" ContentType="{types}.sheet.main+xml"/>'
            f'<Override PartName="/xl/worksheets/sheet1.xml" ContentType="{types}.worksheet+xml"/></Types>',
        "_rels/.rels": related.format(f'<Relationship Id="rId1" Type="{kind}/officeDocument" Target="xl/workbook.xml"/>'),
        "xl/workbook.xml": head + f'<workbook xmlns="{main}" xmlns:r="{kind}">'
                           '<sheets><sheet name="Trace" sheetId="1" r:id="rId1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": related.format(f'<Relationship Id="rId1" Type="{kind}/worksheet" Target="worksheets/sheet1.xml"/>'),
        "xl/worksheets/sheet1.xml": head + f'<worksheet xmlns="{main}"><sheetData>{sheet}</sheetData></worksheet>',
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in parts.items():
            archive.writestr(zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0)), text, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


# --- MAT files of level 5. Classes and types as the format's specification numbers them.

INT8, INT32, UINT32, DOUBLE, UINT16, MATRIX = 1, 5, 6, 9, 4, 14
CELL_CLASS, STRUCT_CLASS, CHAR_CLASS, DOUBLE_CLASS, UINT32_CLASS, OPAQUE_CLASS = 1, 2, 4, 6, 13, 17


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def array(name, shape, kind, *parts):
    return element(MATRIX, element(UINT32, struct.pack("<II", kind, 0)) + element(INT32, np.asarray(shape, "<i4").tobytes()) +
                   element(INT8, name.encode()) + b"".join(parts))


def doubles(name, values):
    values = np.asarray(values, float)
    shape = values.shape if values.ndim == 2 else (len(values), 1)
    return array(name, shape, DOUBLE_CLASS, element(DOUBLE, values.astype("<f8").tobytes(order="F")))


def text_variable(name, text):
    return array(name, (1, len(text)), CHAR_CLASS, element(UINT16, np.array([ord(c) for c in text], "<u2").tobytes()))


def structure(name, elements):
    """A 1xN struct: elements is a list of dicts {field: function of a name that gives the field's bytes}."""
    fields = list(elements[0])
    names = b"".join(f.encode().ljust(32, b"\0") for f in fields)
    length = struct.pack("<HHI", INT32, 4, 32)  # a small element: type, bytes, value
    return array(name, (1, len(elements)), STRUCT_CLASS, length, element(INT8, names),
                 *(e[f] for e in elements for f in fields))


def opaque(name, class_name):
    """A reference to a MATLAB object: all that stands in a file of level 5 in place of a timeseries."""
    numbers_of = np.array([0xDD000000, 2, 1, 1, 1, 1], "<u4")
    reference = array("", (6, 1), UINT32_CLASS, element(UINT32, numbers_of.tobytes()))
    return element(MATRIX, element(UINT32, struct.pack("<II", OPAQUE_CLASS, 0)) + element(INT8, name.encode()) +
                   element(INT8, b"MCOS") + element(INT8, class_name.encode()) + reference)


def mat_file(*variables):
    head = b"MATLAB 5.0 MAT-file, written by tests/files".ljust(116) + b"\0" * 8 + struct.pack("<H", 0x0100) + b"IM"
    return head + b"".join(variables)
