//! A mesh of triangles: its shape at rest, and where its nodes are now.

use crate::camera::{Vec3, cross, dot, minus};
use crate::quantity::{ElasticModel, ModelQuantity};
use crate::surface::{SurfaceError, check_count, check_finite};
use crate::thinning::{Thinning, is_closed};
use std::borrow::Cow;
use std::sync::Arc;

/// Triangles with normals, made ready for the graphics processor.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshData {
    /// Place in mm, unit normal, value of the colours, depth below rest in mm.
    pub(crate) nodes: Vec<[f32; 8]>,
    /// One allocation for all pictures of a shape: that it is the same says that the triangles are.
    pub(crate) indices: Arc<[u32]>,
    /// `None` where all nodes are drawn at every level of detail.
    thinning: Option<Arc<Thinning>>,
    /// Whether its inner side is never seen.
    pub(crate) is_closed: bool,
    /// The longest side of the box at rest.
    pub(crate) size_mm: f64,
    /// Of the box at rest.
    pub(crate) bounds: [Vec3; 2],
}

/// The triangles of a deforming mesh, and where they are at rest. Made once; every picture takes from it what has not moved.
#[derive(Clone, Debug)]
pub struct MeshShape {
    rest: MeshData,
    places: Vec<Vec3>,
    /// Where the triangles around a node begin in `around`.
    around_first: Vec<u32>,
    around: Vec<u32>,
}

/// A node that is not at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovedNode {
    pub node: u32,
    /// Place in mm.
    pub place: Vec3,
    /// Below its place at rest, in mm.
    pub depth_mm: f64,
}

/// Lowest and highest corner of the box around places; a point without any.
fn bounds_of(places: &[Vec3]) -> [Vec3; 2] {
    let first = places.first().copied().unwrap_or_default();
    places.iter().fold([first; 2], |[low, high], place| {
        let pick =
            |from: Vec3, of: fn(f64, f64) -> f64| [0, 1, 2].map(|axis| of(from[axis], place[axis]));
        [pick(low, f64::min), pick(high, f64::max)]
    })
}

/// Rounding to single precision is the only change.
fn node(place: Vec3, normal: Vec3, depth_mm: f64) -> [f32; 8] {
    let ([x, y, z], [u, v, w]) = (place, normal);
    [x, y, z, u, v, w, 0.0, depth_mm].map(|number| number as f32)
}

impl MeshData {
    /// Of places in mm, unit normals and the three nodes of each triangle.
    pub fn new(places: &[Vec3], normals: &[Vec3], indices: Vec<u32>) -> Result<Self, SurfaceError> {
        check_count("normals", normals.len(), places.len())?;
        if !indices.len().is_multiple_of(3) {
            return Err(SurfaceError::Triangles(indices.len()));
        }
        if let Some(at) = indices.iter().position(|&node| node as usize >= places.len()) {
            let (triangle, node) = (at / 3, indices[at]);
            return Err(SurfaceError::Index { triangle, node, nodes: places.len() });
        }
        // A sum is finite only if its parts are.
        check_finite("place", places.iter().map(|place| place.iter().sum()))?;
        check_finite("normal", normals.iter().map(|normal| normal.iter().sum()))?;
        let [low, high] = bounds_of(places);
        let sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        Ok(Self {
            nodes: places
                .iter()
                .zip(normals)
                .map(|(place, normal)| node(*place, *normal, 0.0))
                .collect(),
            indices: indices.into(),
            thinning: None,
            is_closed: false,
            // No division by the size of a point.
            size_mm: sides.into_iter().fold(1e-3, f64::max),
            bounds: [low, high],
        })
    }

    /// Whether levels of detail leave nodes out.
    pub(crate) fn is_thinned(&self) -> bool {
        self.thinning.is_some()
    }

    /// The triangles where one of so many nodes along each direction is drawn. Nodes that are not at rest all are, and so
    /// are those that one of them would stand for.
    pub(crate) fn drawn(&self, every: u32) -> Cow<'_, [u32]> {
        let standing = self.thinning.as_ref().and_then(|thinning| thinning.standing(every));
        let Some(standing) = standing else { return Cow::Borrowed(&self.indices) };
        let is_at_rest = |node: u32| self.nodes[node as usize][7] == 0.0;
        let of = |node: u32| {
            let other = standing[node as usize];
            if is_at_rest(node) && is_at_rest(other) { other } else { node }
        };
        let faces = self.indices.chunks_exact(3).map(|face| [0, 1, 2].map(|at| of(face[at])));
        faces.filter(|[a, b, c]| a != b && b != c && c != a).flatten().collect()
    }

    /// With a number for each node that colours stand for.
    pub fn with_values(mut self, values: &[f32]) -> Result<Self, SurfaceError> {
        check_count("values", values.len(), self.nodes.len())?;
        check_finite("value", values.iter().map(|&value| f64::from(value)))?;
        for (node, &value) in self.nodes.iter_mut().zip(values) {
            node[6] = value;
        }
        Ok(self)
    }

    /// With the depth below rest as what colours stand for, in mm.
    #[must_use]
    pub fn with_depth_as_values(mut self) -> Self {
        for node in &mut self.nodes {
            node[6] = node[7];
        }
        self
    }

    /// With what the fitted models say at the depths of the nodes as what colours stand for: a model for each node, as
    /// [`ElasticModel::blended`] makes it of a painted mesh, or one for all.
    pub fn with_model_as_values(
        mut self,
        quantity: ModelQuantity,
        models: &[ElasticModel],
    ) -> Result<Self, SurfaceError> {
        if models.len() != 1 {
            check_count("models", models.len(), self.nodes.len())?;
        }
        for (node, model) in self.nodes.iter_mut().zip(models.iter().cycle()) {
            node[6] = model.at(quantity, f64::from(node[7])) as f32;
        }
        Ok(self)
    }

    /// With depths below rest in mm, for lines of equal depth.
    pub fn with_depths(mut self, depths: &[f32]) -> Result<Self, SurfaceError> {
        check_count("depths", depths.len(), self.nodes.len())?;
        check_finite("depth", depths.iter().map(|&depth| f64::from(depth)))?;
        for (node, &depth) in self.nodes.iter_mut().zip(depths) {
            node[7] = depth;
        }
        Ok(self)
    }
}

impl MeshShape {
    /// Of places at rest in mm and the nodes of each triangle, counterclockwise as seen from outside.
    pub fn new(places: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, SurfaceError> {
        // Normals follow once the indices are known to be good.
        let nothing = vec![[0.0; 3]; places.len()];
        let rest = MeshData::new(places, &nothing, faces.as_flattened().to_vec())?;
        let mut around_first = vec![0; places.len() + 1];
        for &index in rest.indices.iter() {
            around_first[index as usize + 1] += 1;
        }
        for node in 0..places.len() {
            around_first[node + 1] += around_first[node];
        }
        let mut next = around_first.clone();
        let mut around = vec![0; rest.indices.len()];
        for (corner, &index) in rest.indices.iter().enumerate() {
            let at = &mut next[index as usize];
            around[*at as usize] = corner as u32;
            *at += 1;
        }
        let mut shape = Self { rest, places: places.to_vec(), around_first, around };
        let normals: Vec<Vec3> =
            (0..places.len()).map(|node| shape.normal(node, |index| places[index])).collect();
        let indices = &shape.rest.indices;
        shape.rest.thinning = Some(Arc::new(Thinning::new(places, &normals, indices)));
        shape.rest.is_closed = is_closed(places, indices);
        for (index, (place, normal)) in places.iter().zip(normals).enumerate() {
            shape.rest.nodes[index] = node(*place, normal, 0.0);
        }
        Ok(shape)
    }

    /// All of it at rest.
    #[must_use]
    pub fn at_rest(&self) -> MeshData {
        self.rest.clone()
    }

    /// With these nodes where they are now. Normals follow from the places, those of nodes around too; all others are at rest.
    pub fn displaced(
        &self,
        moved: impl IntoIterator<Item = MovedNode>,
    ) -> Result<MeshData, SurfaceError> {
        let mut data = self.rest.clone();
        let nodes = self.places.len();
        // Which of the moved a node is, counted from 1; and whether its normal is another.
        let (mut which, mut is_touched) = (vec![0_u32; nodes], vec![false; nodes]);
        let (mut places, mut touched) = (Vec::new(), Vec::new());
        for MovedNode { node, place, depth_mm } in moved {
            let index = node as usize;
            let Some(which) = which.get_mut(index) else {
                return Err(SurfaceError::MovedNode { node, nodes });
            };
            if !(place.iter().sum::<f64>() + depth_mm).is_finite() {
                return Err(SurfaceError::NotFinite { what: "place or depth", node: index });
            }
            places.push(place);
            *which = places.len() as u32;
            data.nodes[index] = self::node(place, [0.0; 3], depth_mm);
            for &corner in self.corners_around(index) {
                let first = corner as usize / 3 * 3;
                for &near in &self.rest.indices[first..first + 3] {
                    if !std::mem::replace(&mut is_touched[near as usize], true) {
                        touched.push(near as usize);
                    }
                }
            }
        }
        let place = |index: usize| match which[index] {
            0 => self.places[index],
            one => places[one as usize - 1],
        };
        for index in touched {
            let normal = self.normal(index, place).map(|part| part as f32);
            data.nodes[index][3..6].copy_from_slice(&normal);
        }
        Ok(data)
    }

    fn corners_around(&self, node: usize) -> &[u32] {
        let [from, to] = [node, node + 1].map(|index| self.around_first[index] as usize);
        &self.around[from..to]
    }

    /// Unit normal of a node: that of each triangle around, weighted so that it is exact for corners on a sphere (Max,
    /// "Weights for computing vertex normals from facet normals", J. Graph. Tools 4(2) (1999) 1-6). Up where there is none.
    fn normal(&self, node: usize, place: impl Fn(usize) -> Vec3) -> Vec3 {
        let mut sum = [0.0; 3];
        for &corner in self.corners_around(node) {
            let (first, step) = (corner as usize / 3 * 3, corner as usize % 3);
            let at = |turn: usize| place(self.rest.indices[first + (step + turn) % 3] as usize);
            let (one, other) = (minus(at(1), at(0)), minus(at(2), at(0)));
            let squares = dot(one, one) * dot(other, other);
            if squares > 0.0 {
                let across = cross(one, other);
                sum = [0, 1, 2].map(|axis| sum[axis] + across[axis] / squares);
            }
        }
        let length = dot(sum, sum).sqrt();
        if length > 0.0 { sum.map(|part| part / length) } else { [0.0, 0.0, 1.0] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_without_its_node_is_refused() {
        let (places, normals) = ([[0.0; 3]; 3], [[0.0, 0.0, 1.0]; 3]);
        let refused = MeshData::new(&places, &normals, vec![0, 1, 3]).unwrap_err();
        assert_eq!(refused, SurfaceError::Index { triangle: 0, node: 3, nodes: 3 });
        let refused = MeshData::new(&places, &normals, vec![0, 1]).unwrap_err();
        assert_eq!(refused, SurfaceError::Triangles(2));
        assert!(MeshData::new(&places, &normals[..2], vec![0, 1, 2]).is_err());
    }

    /// An octahedron with its corners on a sphere.
    fn octahedron(radius: f64) -> MeshShape {
        let places = (0..6).map(|node: usize| {
            let mut place = [0.0; 3];
            place[node / 2] = if node.is_multiple_of(2) { radius } else { -radius };
            place
        });
        let faces = [
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        MeshShape::new(&places.collect::<Vec<_>>(), &faces).unwrap()
    }

    #[test]
    fn normals_of_corners_on_a_sphere_are_its_radii() {
        let rest = octahedron(2.0).at_rest();
        assert_eq!(rest.bounds, [[-2.0; 3], [2.0; 3]]);
        assert_eq!(rest.size_mm, 4.0);
        for node in &rest.nodes {
            // Single precision.
            assert!(
                (0..3).all(|axis| (node[axis] / 2.0 - node[axis + 3]).abs() < 1e-6),
                "{node:?}"
            );
        }
    }

    #[test]
    fn what_moves_has_the_normals_of_a_mesh_that_was_there_at_first() {
        let shape = octahedron(1.0);
        let moved = MovedNode { node: 4, place: [0.1, 0.0, 0.3], depth_mm: 0.7 };
        let data = shape.displaced([moved]).unwrap();
        let mut places = shape.places.clone();
        places[4] = moved.place;
        let faces: Vec<[u32; 3]> =
            shape.rest.indices.chunks_exact(3).map(|face| [face[0], face[1], face[2]]).collect();
        let wanted = MeshShape::new(&places, &faces).unwrap().at_rest();
        for (data, wanted) in data.nodes.iter().zip(&wanted.nodes) {
            assert_eq!(data[..6], wanted[..6]);
        }
        assert_eq!(data.nodes[4][7], 0.7);
        assert!(Arc::ptr_eq(&data.indices, &shape.rest.indices));
        assert_eq!(shape.displaced([]).unwrap(), shape.at_rest());
        let refused = shape.displaced([MovedNode { node: 6, ..moved }]).unwrap_err();
        assert_eq!(refused, SurfaceError::MovedNode { node: 6, nodes: 6 });
        assert!(shape.displaced([MovedNode { depth_mm: f64::NAN, ..moved }]).is_err());
    }

    #[test]
    fn a_thinned_mesh_has_fewer_triangles_and_all_of_a_dent() {
        const SIDE: u32 = 21;
        let places: Vec<Vec3> = (0..SIDE * SIDE)
            .map(|node| [f64::from(node % SIDE), f64::from(node / SIDE), 0.0])
            .collect();
        let cells = (0..SIDE - 1).flat_map(|row| (0..SIDE - 1).map(move |x| row * SIDE + x));
        let faces: Vec<[u32; 3]> =
            cells.flat_map(|a| [[a, a + 1, a + SIDE + 1], [a, a + SIDE + 1, a + SIDE]]).collect();
        let shape = MeshShape::new(&places, &faces).unwrap();
        assert!(!shape.rest.is_closed);
        let middle = SIDE * SIDE / 2;
        let moved = MovedNode { node: middle, place: [10.0, 10.0, -1.0], depth_mm: 1.0 };
        for data in [shape.at_rest(), shape.displaced([moved]).unwrap()] {
            assert!(
                matches!(data.drawn(1), Cow::Borrowed(indices) if indices.len() == 3 * faces.len())
            );
            let counts = [2, 3, 4].map(|every| data.drawn(every).len());
            assert!(counts.iter().all(|count| count * 2 < 3 * faces.len()), "{counts:?}");
            // Seen from above nothing is folded and nothing is missing but a rim of cells.
            for every in [2, 3, 4] {
                let area: f64 = data
                    .drawn(every)
                    .chunks_exact(3)
                    .map(|face| {
                        let [a, b, c] = [0, 1, 2].map(|at| places[face[at] as usize]);
                        cross(minus(b, a), minus(c, a))[2] / 2.0
                    })
                    .sum();
                let rim = 20.0 - f64::from(every) * 1.5;
                assert!((rim * rim..=400.0).contains(&area), "{every}: {area}");
            }
        }
        assert!(shape.displaced([moved]).unwrap().drawn(4).contains(&middle));
    }

    #[test]
    fn each_node_has_the_value_of_its_own_model() {
        let shape = octahedron(1.0);
        let moved = MovedNode { node: 1, place: [-0.5, 0.0, 0.0], depth_mm: 0.5 };
        let data = shape.displaced([moved]).unwrap();
        let mut models = vec![ElasticModel { mu: [1.0, 0.0, 0.0] }; 6];
        models[1] = ElasticModel { mu: [2.0, 4.0, 0.0] };
        let values = |quantity, models: &[ElasticModel]| {
            let data = data.clone().with_model_as_values(quantity, models).unwrap();
            data.nodes.iter().map(|node| node[6]).collect::<Vec<_>>()
        };
        assert_eq!(values(ModelQuantity::Force, &models), [0.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(values(ModelQuantity::Stiffness, &models), [1.0, 6.0, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(values(ModelQuantity::Stiffness, &models[1..2])[0], 2.0);
        assert!(data.with_model_as_values(ModelQuantity::Force, &models[..2]).is_err());
    }
}
