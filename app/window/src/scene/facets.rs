//! A surface as triangles: which nodes are drawn, in which order, and how light each is.

use super::camera::{Lens, ProjectedPoint, Vec3, dot};
use eframe::egui::epaint::{Mesh, Vertex, WHITE_UV};
use eframe::egui::{Color32, Pos2};
use palpate_figures::tokens::{dimmed, viridis};
use palpate_haptics::surface::{Grid, GridNode, Heights};

/// Most cells along a side of the drawn surface; one with its lines drawn has half as many.
pub const CELLS_MAX: usize = 128;
/// Points that a cell takes at least: smaller ones would be less than is seen.
const CELL_POINTS: f32 = 4.0;
/// Unit vector from the surface to the light.
const LIGHT: Vec3 = [-0.4, -0.5, 0.768_114_574_786_860_8];
/// Light where no light comes from the lamp.
const AMBIENT: f64 = 0.4;
/// Half the width of a mesh line in points.
const LINE: f32 = 0.5;

/// Colours of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceStyle {
    /// The depth that has the last colour, in mm.
    pub deepest: f64,
    /// Colour of the lines between the cells; `None` for none.
    pub lines: Option<Color32>,
}

/// How light a surface with this unit normal is: Lambert's cosine above the ambient light, 1 towards the lamp.
#[must_use]
pub fn lightness(normal: Vec3) -> f64 {
    AMBIENT + (1.0 - AMBIENT) * dot(normal, LIGHT).max(0.0)
}

/// The depth at which the colours of a scene end: the deepest now, rounded up to 1, 2 or 5 times a power of ten, so
/// that colours stand while the tool moves a little.
#[must_use]
pub fn colour_depth(deepest: f64) -> f64 {
    palpate_figures::drawing::round_up(deepest.clamp(1.0, 1e6))
}

/// Which of so many nodes in a row are drawn: all, or the first, the last, and every n-th such that `keep`, where
/// the tool is, is among them.
#[must_use]
pub fn drawn(count: usize, cells_max: usize, keep: usize) -> Vec<usize> {
    let step = (count - 1).div_ceil(cells_max.max(1));
    let last = count - 1;
    let first = keep.min(last) % step;
    let edges = [0, last];
    let mut nodes: Vec<usize> = (first..count).step_by(step).chain(edges).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// The cells of a row from the far ends towards the place `eye`, which is where the eye is along this axis: no cell is
/// before one that it may hide. `edges` are the places between which the cells are.
#[must_use]
pub fn far_to_near(edges: &[f64], eye: f64) -> Vec<usize> {
    let cells = edges.len().saturating_sub(1);
    // Cells that end before the eye are the nearer the later they are; the others the earlier.
    let split = edges.partition_point(|&edge| edge <= eye).min(cells);
    let split = split.saturating_sub(1);
    (0..split).chain((split..cells).rev()).collect()
}

/// A surface in a picture.
#[derive(Debug)]
pub struct Facets {
    /// Its triangles, back to front.
    pub mesh: Mesh,
    /// Every n-th node is drawn.
    pub every: usize,
    /// The deepest depth of the nodes that are drawn, in mm.
    pub deepest: f64,
}

/// Nodes of a surface as they are drawn.
struct Lattice {
    columns: Vec<usize>,
    rows: Vec<usize>,
}

impl Lattice {
    fn of(grid: &Grid, side_points: f32, tool: Option<GridNode>, has_lines: bool) -> Self {
        let most = if has_lines { CELLS_MAX / 2 } else { CELLS_MAX };
        let seen = (side_points / CELL_POINTS).max(8.0) as usize;
        let tool = tool.unwrap_or_default();
        let pick = |count, keep: u16| drawn(count, most.min(seen), usize::from(keep));
        Self { columns: pick(grid.columns(), tool.column), rows: pick(grid.rows(), tool.row) }
    }

    fn nodes(&self) -> impl Iterator<Item = GridNode> {
        let node = |row: usize, column: usize| GridNode { column: column as u16, row: row as u16 };
        let columns = &self.columns;
        self.rows.iter().flat_map(move |&row| columns.iter().map(move |&column| node(row, column)))
    }
}

/// Triangles of a surface whose heights at rest were `rest`, back to front. `side_points` is the size of the picture;
/// the node at `tool` is drawn whatever is left out.
#[must_use]
pub fn facets(
    now: Heights,
    rest: &[f64],
    lens: &Lens,
    look: SurfaceStyle,
    side_points: f32,
    tool: Option<GridNode>,
) -> Facets {
    let grid = *now.grid();
    let lattice = Lattice::of(&grid, side_points, tool, look.lines.is_some());
    let mut mesh = Mesh::default();
    let mut seen: Vec<Option<ProjectedPoint>> = Vec::new();
    let mut deepest: f64 = 0.0;
    for node in lattice.nodes() {
        let index = grid.index(node);
        let [x, y] = grid.place(node);
        let height = now.all()[index];
        let depth = rest.get(index).map_or(0.0, |rest| rest - height);
        deepest = deepest.max(depth);
        let one = lens.see([x, y, height]);
        let colour = viridis((depth / look.deepest) as f32);
        let light = lightness(now.normal(node)) as f32;
        mesh.vertices.push(Vertex {
            pos: one.map_or(Pos2::ZERO, |one| one.at),
            uv: WHITE_UV,
            color: dimmed(colour, light),
        });
        seen.push(one);
    }
    let place = |nodes: &[usize]| -> Vec<f64> {
        nodes.iter().map(|&node| node as f64 * grid.spacing()).collect()
    };
    let [eye_x, eye_y, _] = lens.eye();
    let columns = far_to_near(&place(&lattice.columns), eye_x);
    let rows = far_to_near(&place(&lattice.rows), eye_y);
    let wide = lattice.columns.len();
    for &row in &rows {
        for &column in &columns {
            let first = row * wide + column;
            let corners = [first, first + 1, first + wide + 1, first + wide];
            if corners.iter().any(|&corner| seen[corner].is_none()) {
                continue;
            }
            let [a, b, c, d] = corners.map(|corner| corner as u32);
            mesh.indices.extend([a, b, c, a, c, d]);
            if let Some(ink) = look.lines {
                let at = corners.map(|corner| mesh.vertices[corner].pos);
                for side in 0..4 {
                    line(&mut mesh, [at[side], at[(side + 1) % 4]], ink);
                }
            }
        }
    }
    Facets { mesh, every: (grid.columns() - 1).div_ceil(lattice.columns.len() - 1), deepest }
}

/// A thin line as two triangles, so that cells drawn later hide it.
fn line(mesh: &mut Mesh, [from, to]: [Pos2; 2], ink: Color32) {
    let aside = (to - from).normalized().rot90() * LINE;
    let first = mesh.vertices.len() as u32;
    for pos in [from - aside, from + aside, to + aside, to - aside] {
        mesh.vertices.push(Vertex { pos, uv: WHITE_UV, color: ink });
    }
    let add = [0, 1, 2, 0, 2, 3].map(|step| first + step);
    mesh.indices.extend(add);
}

#[cfg(test)]
mod tests {
    use super::super::camera::Camera;
    use super::*;
    use eframe::egui::{Rect, pos2};

    fn picture() -> Rect {
        Rect::from_min_max(pos2(0.0, 0.0), pos2(800.0, 600.0))
    }

    const LOOK: SurfaceStyle = SurfaceStyle { deepest: 5.0, lines: None };

    #[test]
    fn colours_end_at_a_round_depth() {
        for (deepest, wanted) in [(0.0, 1.0), (1.2, 2.0), (3.0, 5.0), (f64::INFINITY, 1e6)] {
            let depth = colour_depth(deepest);
            assert!((depth - wanted).abs() < 1e-9 * wanted, "{deepest}");
        }
    }

    #[test]
    fn a_plane_is_as_light_as_its_tilt_says() {
        assert!((dot(LIGHT, LIGHT) - 1.0).abs() < 1e-12);
        assert!((lightness(LIGHT) - 1.0).abs() < 1e-12);
        assert!((lightness(LIGHT.map(|part| -part)) - AMBIENT).abs() < 1e-12);
        // z = 0.5 x: its normal is (-0.5, 0, 1) / sqrt(1.25) at every node, borders included.
        let grid = Grid::new(9, 7, 2.0).unwrap();
        let heights: Vec<f64> = (0..63).map(|index| f64::from(index % 9)).collect();
        let heights = Heights::new(grid, &heights).unwrap();
        let by = 1.25_f64.sqrt();
        let wanted = AMBIENT + (1.0 - AMBIENT) * (0.5 * 0.4 + LIGHT[2]) / by;
        for (column, row) in [(0, 0), (4, 3), (8, 6)] {
            let normal = heights.normal(GridNode { column, row });
            for (part, wanted) in normal.into_iter().zip([-0.5 / by, 0.0, 1.0 / by]) {
                assert!((part - wanted).abs() < 1e-12);
            }
            assert!((lightness(normal) - wanted).abs() < 1e-12);
        }
        let lens = Camera::of(grid.extent()).lens(picture());
        let drawn = facets(heights, heights.all(), &lens, LOOK, 800.0, None);
        let ink = dimmed(viridis(0.0), wanted as f32);
        assert!(drawn.mesh.vertices.iter().all(|one| one.color == ink));
        assert_ne!(ink, viridis(0.0));
    }

    #[test]
    fn thinning_keeps_the_ends_and_the_tool() {
        for (count, most, keep) in [(2, 128, 0), (201, 128, 77), (1001, 64, 513), (10, 1, 4)] {
            let nodes = drawn(count, most, keep);
            for one in [0, count - 1, keep] {
                assert!(nodes.contains(&one), "{count} {most} {keep}: {nodes:?}");
            }
            assert!(nodes.is_sorted() && nodes.len() <= most + 3);
        }
        assert_eq!(drawn(5, 128, 3), [0, 1, 2, 3, 4]);
        assert_eq!(drawn(11, 4, 4), [0, 1, 4, 7, 10]);
    }

    #[test]
    fn no_cell_is_drawn_before_one_that_it_may_hide() {
        let edges: Vec<f64> = (0..=8).map(f64::from).collect();
        assert_eq!(far_to_near(&edges, -3.0), [7, 6, 5, 4, 3, 2, 1, 0]);
        assert_eq!(far_to_near(&edges, 30.0), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(far_to_near(&edges, 2.5), [0, 1, 7, 6, 5, 4, 3, 2]);
        for eye in [-1.0, 0.0, 0.5, 3.0, 3.2, 7.9, 8.0, 9.0] {
            let order = far_to_near(&edges, eye);
            assert_eq!(order.len(), 8);
            let side = |cell: usize| (cell as f64 + 0.5 - eye).signum();
            let far = |cell: usize| (cell as f64 + 0.5 - eye).abs();
            for (place, &cell) in order.iter().enumerate() {
                for &later in &order[place + 1..] {
                    assert!(side(later) != side(cell) || far(later) < far(cell), "{eye} {order:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_in_front_is_drawn_last() {
        // A wall across the surface, and a camera that looks at it from the front: at the wall's place in the
        // picture the last triangle must be one of the wall.
        let grid = Grid::new(21, 21, 1.0).unwrap();
        let mut heights = vec![0.0; 441];
        heights[10 * 21..11 * 21].fill(4.0);
        let rest = vec![4.0; 441];
        let mut camera = Camera::of(grid.extent());
        camera.orbit(-0.5, -0.4);
        let lens = camera.lens(picture());
        let now = Heights::new(grid, &heights).unwrap();
        let drawn = facets(now, &rest, &lens, LOOK, 800.0, None);
        assert_eq!(drawn.every, 1);
        assert_eq!(drawn.mesh.indices.len(), 20 * 20 * 6);
        assert!((drawn.deepest - 4.0).abs() < 1e-12);
        // Behind the wall the surface is hidden where the wall's front face is drawn over it.
        let front = lens.see([10.0, 9.5, 2.0]).unwrap().at;
        let covers = |triangle: &[u32]| {
            let at = [0, 1, 2].map(|i| drawn.mesh.vertices[triangle[i] as usize].pos - front);
            let turns = [0, 1, 2].map(|i| {
                let (a, b) = (at[i], at[(i + 1) % 3]);
                a.x * b.y - a.y * b.x
            });
            turns.iter().all(|&turn| turn >= 0.0) || turns.iter().all(|&turn| turn <= 0.0)
        };
        let covering: Vec<&[u32]> =
            drawn.mesh.indices.chunks(3).filter(|triangle| covers(triangle)).collect();
        assert!(covering.len() > 1, "the wall hides something there");
        let rows = |triangle: &[u32]| triangle.iter().map(|one| one / 21).max();
        assert_eq!(rows(covering[covering.len() - 1]), Some(10));
        assert!(rows(covering[0]) > Some(10));
    }

    #[test]
    fn a_large_mesh_is_thinned_and_says_so_and_the_poke_keeps_its_tip() {
        let grid = Grid::new(1001, 1001, 0.1).unwrap();
        let rest = vec![0.0; grid.nodes()];
        let mut heights = rest.clone();
        let tool = GridNode { column: 333, row: 501 };
        heights[grid.index(tool)] = -3.0;
        let now = Heights::new(grid, &heights).unwrap();
        let lens = Camera::of(grid.extent()).lens(picture());
        let drawn = facets(now, &rest, &lens, LOOK, 800.0, Some(tool));
        assert!(drawn.every > 1);
        assert!(drawn.mesh.vertices.len() <= (CELLS_MAX + 3).pow(2));
        assert!((drawn.deepest - 3.0).abs() < 1e-12);
        let lines = SurfaceStyle { lines: Some(Color32::BLACK), ..LOOK };
        let lined = facets(now, &rest, &lens, lines, 800.0, Some(tool));
        assert!(lined.every > drawn.every);
        assert!(lined.mesh.indices.len() <= (CELLS_MAX / 2 + 2).pow(2) * 30);
        assert!(lined.mesh.is_valid());
    }

    #[test]
    fn from_among_the_cells_nothing_behind_the_eye_is_drawn() {
        let grid = Grid::new(41, 41, 1.0).unwrap();
        let rest = vec![0.0; grid.nodes()];
        let now = Heights::new(grid, &rest).unwrap();
        let mut camera = Camera::of(grid.extent());
        camera.orbit(0.0, -9.0);
        camera.zoom(1e3);
        let drawn = facets(now, &rest, &camera.lens(picture()), LOOK, 800.0, None);
        let cells = drawn.mesh.indices.len() / 6;
        assert!(cells > 0 && cells < 1600, "{cells}");
        assert!(drawn.mesh.vertices.iter().all(|one| one.pos.is_finite()));
    }
}
