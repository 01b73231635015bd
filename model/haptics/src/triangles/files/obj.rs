//! Wavefront OBJ: lines `v x y z` and `f a b c`.

use super::{MeshFileError, MeshUnit, TriangleSoup, check_faces};

/// Reads positions, colours and faces; faces of more corners become fans, and everything else is left out.
pub fn read_obj(bytes: &[u8], unit: MeshUnit) -> Result<TriangleSoup, MeshFileError> {
    let text = String::from_utf8_lossy(bytes);
    let mut soup = TriangleSoup::default();
    let mut corners = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((index, first)) = lines.next() {
        let mut joined;
        let mut line = first.split('#').next().unwrap_or_default().trim();
        // A line that ends with a backslash goes on in the next.
        if line.ends_with('\\') {
            joined = String::new();
            while let Some(part) = line.strip_suffix('\\') {
                joined.push_str(part);
                line = lines.next().map_or("", |(_, next)| next.trim());
            }
            joined.push_str(line);
            line = &joined;
        }
        let refused = |what| MeshFileError::ObjLine {
            line: index + 1,
            what,
            text: line.chars().take(60).collect(),
        };
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
                let numbers = numbers
                    .filter(|numbers| numbers.len() >= 3)
                    .ok_or_else(|| refused("vertex"))?;
                soup.points.push([0, 1, 2].map(|axis| numbers[axis] * unit.mm()));
                // Three more numbers are a colour, by the practice of MeshLab and Blender; one alone is a weight.
                if numbers.len() >= 6 {
                    soup.colours.push([numbers[3], numbers[4], numbers[5]]);
                }
            }
            Some("f") => {
                corners.clear();
                for word in words {
                    let vertex = word.split('/').next().unwrap_or_default();
                    let vertex: i64 = vertex.parse().map_err(|_| refused("face"))?;
                    corners.push(corner(vertex, soup.points.len(), index + 1)?);
                }
                let [start, others @ ..] = &corners[..] else { return Err(refused("face")) };
                if others.len() < 2 {
                    return Err(refused("face"));
                }
                soup.faces.extend(others.windows(2).map(|pair| [*start, pair[0], pair[1]]));
                check_faces(soup.faces.len())?;
            }
            _ => {}
        }
    }
    if !soup.colours.is_empty() && soup.colours.len() != soup.points.len() {
        return Err(MeshFileError::ObjColours);
    }
    Ok(soup)
}

/// Counted from 1, or backwards from -1.
fn corner(index: i64, vertices: usize, line: usize) -> Result<u32, MeshFileError> {
    let at = if index < 0 { vertices as i64 + index } else { index - 1 };
    if index == 0 || at < 0 || at >= vertices as i64 {
        return Err(MeshFileError::ObjIndex { line, index, vertices });
    }
    Ok(at as u32)
}
