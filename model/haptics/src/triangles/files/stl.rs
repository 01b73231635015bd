//! STL: three corners for every triangle.

use super::{MeshFileError, MeshUnit, TriangleSoup, check_faces};

/// Heading of a binary file, and its number of triangles.
const HEAD: usize = 84;
/// Normal, three corners and two bytes of attributes.
const FACE: usize = 50;

/// Reads ASCII or binary, whichever it is. Normals are left out: corners say the same more exactly.
pub fn read_stl(bytes: &[u8], unit: MeshUnit) -> Result<TriangleSoup, MeshFileError> {
    // A binary file may begin with "solid", too, but only a binary one is as long as its number of triangles needs.
    let faces = bytes.get(80..HEAD).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    let needed = faces.map(|faces| HEAD + FACE * faces as usize);
    let starts = bytes.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(0);
    let is_text = bytes[starts..].starts_with(b"solid") && needed != Some(bytes.len());
    if is_text { ascii(&String::from_utf8_lossy(bytes), unit) } else { binary(bytes, unit) }
}

fn binary(bytes: &[u8], unit: MeshUnit) -> Result<TriangleSoup, MeshFileError> {
    let count =
        bytes.get(80..HEAD).and_then(|count| count.try_into().ok()).map_or(0, u32::from_le_bytes);
    let faces = count as usize;
    check_faces(faces)?;
    let needed = HEAD + FACE * faces;
    if bytes.len() < needed {
        return Err(MeshFileError::StlShort { bytes: bytes.len(), faces, needed });
    }
    let mut soup = TriangleSoup::default();
    for face in bytes[HEAD..needed].chunks_exact(FACE) {
        let first = soup.points.len() as u32;
        for corner in face[12..48].chunks_exact(12) {
            soup.points.push([0, 1, 2].map(|axis| {
                let at = 4 * axis;
                let number = [corner[at], corner[at + 1], corner[at + 2], corner[at + 3]];
                f64::from(f32::from_le_bytes(number)) * unit.mm()
            }));
        }
        soup.faces.push([first, first + 1, first + 2]);
    }
    Ok(soup)
}

fn ascii(text: &str, unit: MeshUnit) -> Result<TriangleSoup, MeshFileError> {
    let mut soup = TriangleSoup::default();
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if words.next() != Some("vertex") {
            continue;
        }
        let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
        let [x, y, z] = numbers.as_deref().unwrap_or_default() else {
            let text = line.trim().chars().take(60).collect();
            return Err(MeshFileError::StlLine { line: index + 1, text });
        };
        soup.points.push([x, y, z].map(|part| part * unit.mm()));
        check_faces(soup.points.len() / 3)?;
    }
    if !soup.points.len().is_multiple_of(3) {
        return Err(MeshFileError::StlCorners(soup.points.len()));
    }
    soup.faces = (0..soup.points.len() as u32 / 3)
        .map(|face| [0, 1, 2].map(|corner| 3 * face + corner))
        .collect();
    Ok(soup)
}
