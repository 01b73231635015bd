"""Writes zwick.xlsx and zwick.xls, the same small workbook in both formats, with nothing but Python.

The layout is that of a testXpert export: a sheet of parameters, one of results, and one sheet for each
specimen with its name, the columns' names, their units, and the rows. Run it in this folder.
"""

import struct
import zipfile

ROWS = [(0.1 * i, 0.25 * i, 0.5 + 0.125 * i * i) for i in range(20)]
SHEETS = [
    ("Paramètres", [["Vitesse d'essai", 10, "mm/min"], ["Précharge", 0.05, "N"]]),
    ("Résultats", [["N°", "Fmax", "dL à Fmax"], [None, "N", "mm"], [1, 45.6, 4.75], [2, 46.6, 4.75]]),
    ("P002-1", [["P002-1"], ["Temps d'essai", "Déformation", "Force standard"], ["s", "mm", "N"]]
     + [list(row) for row in ROWS]),
    ("P002-2", [["P002-2"], ["Temps d'essai", "Déformation", "Force standard"], ["min", "µm", "mN"]]
     + [[t / 60, x * 1000, f * 1000] for t, x, f in ROWS]),
]


def escape(text):
    return text.replace("&", "&amp;").replace("<", "&lt;")


def xlsx(path):
    texts = []

    def cell(row, column, value):
        place = f'r="{chr(65 + column)}{row + 1}"'
        if isinstance(value, str):
            if value not in texts:
                texts.append(value)
            return f'<c {place} t="s"><v>{texts.index(value)}</v></c>'
        return f"<c {place}><v>{value!r}</v></c>"

    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    rel = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006/relationships"
    head = '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>'
    files = {}
    for number, (_, rows) in enumerate(SHEETS, 1):
        body = "".join(
            f'<row r="{i + 1}">' + "".join(cell(i, j, v) for j, v in enumerate(row) if v is not None) + "</row>"
            for i, row in enumerate(rows)
        )
        files[f"xl/worksheets/sheet{number}.xml"] = (
            f'{head}<worksheet xmlns="{main}"><sheetData>{body}</sheetData></worksheet>'
        )
    shared = "".join(f"<si><t>{escape(text)}</t></si>" for text in texts)
    files["xl/sharedStrings.xml"] = (
        f'{head}<sst xmlns="{main}" count="{len(texts)}" uniqueCount="{len(texts)}">{shared}</sst>'
    )
    sheets = "".join(
        f'<sheet name="{escape(name)}" sheetId="{n}" r:id="rId{n}"/>' for n, (name, _) in enumerate(SHEETS, 1)
    )
    files["xl/workbook.xml"] = f'{head}<workbook xmlns="{main}" xmlns:r="{rel}"><sheets>{sheets}</sheets></workbook>'
    links = "".join(
        f'<Relationship Id="rId{n}" Type="{rel}/worksheet" Target="worksheets/sheet{n}.xml"/>'
        for n in range(1, len(SHEETS) + 1)
    )
    links += f'<Relationship Id="rId99" Type="{rel}/sharedStrings" Target="sharedStrings.xml"/>'
    files["xl/_rels/workbook.xml.rels"] = f'{head}<Relationships xmlns="{package}">{links}</Relationships>'
    files["_rels/.rels"] = (
        f'{head}<Relationships xmlns="{package}"><Relationship Id="rId1" Type="{rel}/officeDocument" '
        'Target="xl/workbook.xml"/></Relationships>'
    )
    kinds = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    parts = "".join(
        f'<Override PartName="/xl/worksheets/sheet{n}.xml" ContentType="{kinds}.worksheet+xml"/>'
        for n in range(1, len(SHEETS) + 1)
    )
    files["[Content_Types].xml"] = (
        f'{head}<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        f'<Override PartName="/xl/workbook.xml" ContentType="{kinds}.sheet.main+xml"/>'
        f'<Override PartName="/xl/sharedStrings.xml" ContentType="{kinds}.sharedStrings+xml"/>{parts}</Types>'
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0))
            archive.writestr(info, content, zipfile.ZIP_DEFLATED)


def record(kind, content=b""):
    return struct.pack("<HH", kind, len(content)) + content


def label(text):
    """A text in two bytes a letter, [MS-XLS] 2.5.294."""
    return struct.pack("<HB", len(text), 1) + text.encode("utf-16-le")


def biff():
    """The stream of the workbook, [MS-XLS] 2.4."""

    def begin(kind):
        return record(0x0809, struct.pack("<HHHHII", 0x0600, kind, 0x0DBB, 0x07CC, 0, 6))

    sheets = []
    for _, rows in SHEETS:
        width = max(len(row) for row in rows)
        body = begin(0x0010) + record(0x0200, struct.pack("<IIHHH", 0, len(rows), 0, width, 0))
        for i, row in enumerate(rows):
            for j, value in enumerate(row):
                place = struct.pack("<HHH", i, j, 0)
                if isinstance(value, str):
                    body += record(0x0204, place + label(value))
                elif value is not None:
                    body += record(0x0203, place + struct.pack("<d", value))
        sheets.append(body + record(0x000A))
    names = [(name, label(name)) for name, _ in SHEETS]
    # The records before the sheets have a known length, so the sheets' places are known.
    bound = lambda place, name: record(
        0x0085, struct.pack("<IBBBB", place, 0, 0, len(name), 1) + name.encode("utf-16-le")
    )
    head = begin(0x0005) + record(0x0042, struct.pack("<H", 1200))
    length = len(head) + sum(len(bound(0, name)) for name, _ in names) + len(record(0x000A))
    for (name, _), sheet in zip(names, sheets):
        head += bound(length, name)
        length += len(sheet)
    return head + record(0x000A) + b"".join(sheets)


def xls(path):
    """One stream in a compound file, [MS-CFB]."""
    size = 512
    stream = biff()
    stream += b"\0" * (max(4096, -(-len(stream) // size) * size) - len(stream))
    count = len(stream) // size
    end, fat_mark, free = 0xFFFFFFFE, 0xFFFFFFFD, 0xFFFFFFFF
    # Sector 0 is the table, sector 1 the folder, the stream follows.
    table = [fat_mark, end] + [n + 3 for n in range(count - 1)] + [end]
    assert len(table) <= size // 4
    table += [free] * (size // 4 - len(table))

    def entry(name, kind, start, length, child):
        text = (name + "\0").encode("utf-16-le")
        return (
            text.ljust(64, b"\0") + struct.pack("<HBBIII", len(text), kind, 1, free, free, child)
            + b"\0" * 36 + struct.pack("<IQ", start, length)
        )

    folder = entry("Root Entry", 5, end, 0, 1) + entry("Workbook", 2, 2, len(stream), free)
    folder += b"\0" * (size - len(folder))
    header = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 16
    header += struct.pack("<HHHHH6sIIIIIIIII", 0x3E, 3, 0xFFFE, 9, 6, b"\0" * 6, 0, 1, 1, 0, 4096, end, 0, end, 0)
    header += struct.pack("<I", 0) + struct.pack("<I", free) * 108
    assert len(header) == size
    with open(path, "wb") as file:
        file.write(header + struct.pack(f"<{size // 4}I", *table) + folder + stream)


xlsx("zwick.xlsx")
xls("zwick.xls")
