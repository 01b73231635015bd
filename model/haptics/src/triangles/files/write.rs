//! Meshes as files, for examples and for other programs.

use super::TriangleSoup;
use std::fmt::Write;

/// OBJ in mm, with colours where there are.
#[must_use]
pub fn write_obj(soup: &TriangleSoup) -> String {
    let mut text = String::from("# mm\n");
    for (index, [x, y, z]) in soup.points.iter().enumerate() {
        // Writing to a text cannot fail.
        let _ = write!(text, "v {x} {y} {z}");
        if let Some([red, green, blue]) = soup.colours.get(index) {
            let _ = write!(text, " {red} {green} {blue}");
        }
        text.push('\n');
    }
    for face in &soup.faces {
        let [a, b, c] = face.map(|vertex| vertex + 1);
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text
}

/// Binary STL in mm; coordinates are rounded to single precision. Triangles must have their vertices.
#[must_use]
pub fn write_stl(soup: &TriangleSoup) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((soup.faces.len() as u32).to_le_bytes());
    for face in &soup.faces {
        // No normal: readers take that of the corners.
        bytes.extend([0; 12]);
        for part in face.iter().flat_map(|vertex| soup.points[*vertex as usize]) {
            bytes.extend((part as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// GLB in metres; coordinates and colours are rounded to single precision.
#[must_use]
pub fn write_glb(soup: &TriangleSoup) -> Vec<u8> {
    let mut binary = Vec::new();
    for face in &soup.faces {
        face.iter().for_each(|vertex| binary.extend(vertex.to_le_bytes()));
    }
    let indices = binary.len();
    for point in &soup.points {
        point.iter().for_each(|part| binary.extend(((part / 1000.0) as f32).to_le_bytes()));
    }
    let positions = binary.len() - indices;
    for colour in &soup.colours {
        colour.iter().for_each(|part| binary.extend((*part as f32).to_le_bytes()));
    }
    let colours = binary.len() - indices - positions;
    let mut json = json(soup, [indices, positions, colours]);
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let mut bytes = b"glTF".to_vec();
    let number = |bytes: &mut Vec<u8>, value: usize| bytes.extend((value as u32).to_le_bytes());
    number(&mut bytes, 2);
    number(&mut bytes, total);
    number(&mut bytes, json.len());
    bytes.extend(b"JSON");
    bytes.extend(json.bytes());
    number(&mut bytes, binary.len());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

fn json(soup: &TriangleSoup, [indices, positions, colours]: [usize; 3]) -> String {
    let start = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let [low, high] = soup.points.iter().fold(start, |[low, high], point| {
        // The specification wants the bounds of the numbers as stored.
        let point = point.map(|part| f64::from((part / 1000.0) as f32));
        [
            [0, 1, 2].map(|axis| low[axis].min(point[axis])),
            [0, 1, 2].map(|axis| high[axis].max(point[axis])),
        ]
    });
    let count = soup.points.len();
    let mut attributes = serde_json::json!({ "POSITION": 1 });
    let mut accessors = vec![
        serde_json::json!({ "bufferView": 0, "componentType": 5125, "count": 3 * soup.faces.len(), "type": "SCALAR" }),
        serde_json::json!({ "bufferView": 1, "componentType": 5126, "count": count, "type": "VEC3", "min": low, "max": high }),
    ];
    let mut views = vec![
        serde_json::json!({ "buffer": 0, "byteOffset": 0, "byteLength": indices, "target": 34963 }),
        serde_json::json!({ "buffer": 0, "byteOffset": indices, "byteLength": positions, "target": 34962 }),
    ];
    if colours > 0 {
        attributes["COLOR_0"] = 2.into();
        accessors.push(serde_json::json!({ "bufferView": 2, "componentType": 5126, "count": count, "type": "VEC3" }));
        views.push(serde_json::json!({ "buffer": 0, "byteOffset": indices + positions, "byteLength": colours, "target": 34962 }));
    }
    serde_json::json!({
        "asset": { "version": "2.0", "generator": "palpate" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": 0, "mode": 4 }] }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": indices + positions + colours }],
    })
    .to_string()
}
