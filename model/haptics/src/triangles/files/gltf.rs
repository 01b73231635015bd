//! glTF 2.0: triangles of the scene's meshes, each where its node has it.
//!
//! Skins, morph targets and sparse accessors are left out or refused.

use super::base64;
use super::gltf_document::{Accessor, Document, Node, Primitive};
use super::{MeshFileError as Error, TriangleSoup, check_faces};

/// A metre in mm.
const METRE: f64 = 1000.0;
/// Nodes within nodes: more are a circle.
const DEEPEST: usize = 64;
/// Nodes of a scene, each counted as often as it is reached: more are a circle.
const MOST_NODES: usize = 100_000;
const JSON: u32 = 0x4E4F_534A;
const BINARY: u32 = 0x004E_4942;

/// Three rows of a transform.
type Frame = [[f64; 4]; 3];

const STILL: Frame = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Reads a GLB, or a glTF whose buffers are in it as `data:`. Lengths become mm.
pub fn read_gltf(bytes: &[u8]) -> Result<TriangleSoup, Error> {
    let (json, binary) = if bytes.starts_with(b"glTF") { chunks(bytes)? } else { (bytes, None) };
    let document: Document =
        serde_json::from_slice(json).map_err(|error| Error::Gltf(error.to_string()))?;
    let is_read = |name: &&String| {
        name.as_str() != "KHR_mesh_quantization" && name.as_str() != "KHR_materials_unlit"
    };
    if let Some(name) = document.extensions_required.iter().find(is_read) {
        return Err(Error::GltfExtension(name.clone()));
    }
    let mut reader = Reader {
        buffers: buffers(&document, binary)?,
        document: &document,
        soup: TriangleSoup::default(),
        nodes: 0,
        is_coloured: true,
    };
    for root in roots(&document)? {
        reader.node(root, &STILL, 0)?;
    }
    let Reader { mut soup, is_coloured, .. } = reader;
    // Colours of some meshes alone are no map of materials.
    if !is_coloured {
        soup.colours.clear();
    }
    Ok(soup)
}

/// JSON and binary chunk of a GLB.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Error> {
    let number = |at: usize| {
        let four = bytes.get(at..at + 4).and_then(|four| four.try_into().ok());
        four.map(u32::from_le_bytes)
    };
    let short = || Error::Gltf("it ends within a chunk".to_owned());
    if number(4) != Some(2) {
        return Err(Error::Gltf("it is not of version 2".to_owned()));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while at + 8 <= bytes.len() {
        let (Some(length), Some(kind)) = (number(at), number(at + 4)) else { return Err(short()) };
        let end = (at + 8).checked_add(length as usize).ok_or_else(short)?;
        let chunk = bytes.get(at + 8..end).ok_or_else(short)?;
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BINARY if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = end;
    }
    Ok((json.ok_or_else(short)?, binary))
}

fn buffers(document: &Document, binary: Option<&[u8]>) -> Result<Vec<Vec<u8>>, Error> {
    let one = |(index, buffer): (usize, &super::gltf_document::Buffer)| match &buffer.uri {
        None if index == 0 => Ok(binary.unwrap_or_default().to_vec()),
        None => Err(Error::GltfPart { what: "second buffer" }),
        Some(uri) => {
            let Some(data) = uri.strip_prefix("data:") else {
                return Err(Error::GltfExternal(uri.clone()));
            };
            let text = data.split_once(";base64,").map(|(_, text)| text);
            text.and_then(base64::decode).ok_or(Error::GltfPart { what: "buffer" })
        }
    };
    document.buffers.iter().enumerate().map(one).collect()
}

/// Nodes of the scene, or where there is none those that are in no other.
fn roots(document: &Document) -> Result<Vec<usize>, Error> {
    match document.scenes.get(document.scene.unwrap_or(0)) {
        Some(scene) => Ok(scene.nodes.clone()),
        None if document.scene.is_some() => Err(Error::GltfPart { what: "scene" }),
        None => {
            let mut is_child = vec![false; document.nodes.len()];
            for &child in document.nodes.iter().flat_map(|node| &node.children) {
                *is_child.get_mut(child).ok_or(Error::GltfPart { what: "node" })? = true;
            }
            Ok((0..is_child.len()).filter(|node| !is_child[*node]).collect())
        }
    }
}

struct Reader<'a> {
    document: &'a Document,
    buffers: Vec<Vec<u8>>,
    soup: TriangleSoup,
    nodes: usize,
    is_coloured: bool,
}

impl Reader<'_> {
    fn node(&mut self, index: usize, outer: &Frame, depth: usize) -> Result<(), Error> {
        self.nodes += 1;
        if depth > DEEPEST || self.nodes > MOST_NODES {
            return Err(Error::GltfPart { what: "tree of nodes" });
        }
        let document = self.document;
        let node = document.nodes.get(index).ok_or(Error::GltfPart { what: "node" })?;
        let frame = within(outer, &frame(node));
        if let Some(mesh) = node.mesh {
            let mesh = document.meshes.get(mesh).ok_or(Error::GltfPart { what: "mesh" })?;
            for primitive in &mesh.primitives {
                self.primitive(primitive, &frame)?;
            }
        }
        node.children.iter().try_for_each(|child| self.node(*child, &frame, depth + 1))
    }

    fn primitive(&mut self, primitive: &Primitive, frame: &Frame) -> Result<(), Error> {
        let mode = primitive.mode.unwrap_or(4);
        // Points and lines are no surface.
        let (4..=6, Some(position)) = (mode, primitive.attributes.position) else { return Ok(()) };
        let what = "positions";
        let first = self.soup.points.len() as u32;
        let points = self.numbers(position, 3, what)?;
        let count = points.len() / 3;
        for point in points.chunks_exact(3) {
            self.soup.points.push(
                frame.map(|[x, y, z, way]| {
                    METRE * (x * point[0] + y * point[1] + z * point[2] + way)
                }),
            );
        }
        self.colours(primitive, count)?;
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => {
                self.numbers(indices, 1, "indices")?.iter().map(|one| *one as u32).collect()
            }
            None => (0..count as u32).collect(),
        };
        if corners.iter().any(|corner| *corner as usize >= count) {
            return Err(Error::GltfPart { what: "indices" });
        }
        // A mirror turns triangles over.
        let is_mirror = determinant(frame) < 0.0;
        for mut face in triangles(mode, &corners) {
            if is_mirror {
                face.swap(1, 2);
            }
            // Strips are joined by triangles without area.
            let is_joint =
                mode != 4 && (face[0] == face[1] || face[1] == face[2] || face[0] == face[2]);
            if !is_joint {
                self.soup.faces.push(face.map(|corner| first + corner));
            }
        }
        check_faces(self.soup.faces.len())
    }

    fn colours(&mut self, primitive: &Primitive, count: usize) -> Result<(), Error> {
        let Some(colour) = primitive.attributes.colour else {
            self.is_coloured = false;
            return Ok(());
        };
        let what = "colours";
        let accessor = self.document.accessors.get(colour).ok_or(Error::GltfPart { what })?;
        let parts = if accessor.shape == "VEC3" { 3 } else { 4 };
        let numbers = self.numbers(colour, parts, what)?;
        if numbers.len() / parts != count {
            return Err(Error::GltfPart { what });
        }
        self.soup.colours.extend(numbers.chunks_exact(parts).map(|one| [one[0], one[1], one[2]]));
        Ok(())
    }

    /// Numbers of an accessor of `parts` each.
    fn numbers(&self, index: usize, parts: usize, what: &'static str) -> Result<Vec<f64>, Error> {
        let refused = || Error::GltfPart { what };
        let accessor = self.document.accessors.get(index).ok_or_else(refused)?;
        let (width, number) = component(accessor).ok_or_else(refused)?;
        let shape = ["SCALAR", "VEC2", "VEC3", "VEC4"][parts - 1];
        if accessor.shape != shape || accessor.sparse.is_some() || accessor.count == 0 {
            return Err(refused());
        }
        let view = accessor.buffer_view.and_then(|view| self.document.buffer_views.get(view));
        let view = view.ok_or_else(refused)?;
        let buffer = self.buffers.get(view.buffer).ok_or_else(refused)?;
        let end = view.byte_offset.checked_add(view.byte_length).ok_or_else(refused)?;
        let bytes = buffer.get(view.byte_offset..end).ok_or_else(refused)?;
        let stride = view.byte_stride.unwrap_or(parts * width);
        // All of it before anything is allocated for it.
        let last = stride
            .checked_mul(accessor.count - 1)
            .and_then(|way| way.checked_add(accessor.byte_offset));
        let needed = last.and_then(|last| last.checked_add(parts * width)).ok_or_else(refused)?;
        if stride < parts * width || needed > bytes.len() {
            return Err(refused());
        }
        let mut numbers = Vec::with_capacity(parts * accessor.count);
        for item in 0..accessor.count {
            let at = accessor.byte_offset + item * stride;
            numbers.extend(bytes[at..at + parts * width].chunks_exact(width).map(&number));
        }
        Ok(numbers)
    }
}

/// Width of a number in bytes and what it is.
fn component(accessor: &Accessor) -> Option<(usize, impl Fn(&[u8]) -> f64)> {
    let (kind, is_share) = (accessor.component_type, accessor.normalized);
    let width = match kind {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => return None,
    };
    Some((width, move |bytes: &[u8]| {
        let mut four = [0; 4];
        four[..bytes.len()].copy_from_slice(bytes);
        let whole = u32::from_le_bytes(four);
        let (value, most) = match kind {
            5120 => (f64::from(whole as u8 as i8), 127.0),
            5121 => (f64::from(whole as u8), 255.0),
            5122 => (f64::from(whole as u16 as i16), 32_767.0),
            5123 => (f64::from(whole as u16), 65_535.0),
            5125 => (f64::from(whole), 1.0),
            _ => (f64::from(f32::from_bits(whole)), 1.0),
        };
        if is_share { (value / most).max(-1.0) } else { value }
    }))
}

fn triangles(mode: u32, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        5 => corners
            .windows(3)
            .enumerate()
            .map(|(index, three)| {
                let turn = index % 2;
                [three[0], three[1 + turn], three[2 - turn]]
            })
            .collect(),
        6 => corners
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|two| [two[0], two[1], corners[0]])
            .collect(),
        _ => corners.chunks_exact(3).map(|three| [three[0], three[1], three[2]]).collect(),
    }
}

fn frame(node: &Node) -> Frame {
    if let Some(matrix) = node.matrix {
        return [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| matrix[4 * column + row]));
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let turn = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let scale = node.scale.unwrap_or([1.0; 3]);
    let way = node.translation.unwrap_or([0.0; 3]);
    [0, 1, 2].map(|row| {
        let [a, b, c] = [0, 1, 2].map(|column| turn[row][column] * scale[column]);
        [a, b, c, way[row]]
    })
}

fn within(outer: &Frame, inner: &Frame) -> Frame {
    outer.map(|row| {
        [0, 1, 2, 3].map(|column| {
            let sum: f64 = (0..3).map(|at| row[at] * inner[at][column]).sum();
            if column == 3 { sum + row[3] } else { sum }
        })
    })
}

fn determinant([a, b, c]: &Frame) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}
