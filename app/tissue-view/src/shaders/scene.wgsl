// What all shaders share: the scene's numbers, and where its points are. Lengths in mm, z up.

struct Scene {
    view_projection: mat4x4f,
    // Position of the eye; w: half the picture's height in pixels over the tangent of half its angle.
    eye: vec4f,
    // Unit vector to the lamp.
    light: vec4f,
    // Columns, rows, spacing, thickness drawn at the sides. Of a mesh: unit normal of the tissue below the probe and how far
    // along it the tissue is, or zero.
    grid: vec4f,
    // Centre of the tip's sphere, its radius.
    probe: vec4f,
    // Unit vector from the tip up the shaft, length of the shaft.
    axis: vec4f,
    // Radius of the shaft, 1 if there is a probe, 1 for a glove, 0 for steel.
    shaft: vec4f,
    // Least and greatest value of the colours, 1 if colours are data, distance between contour lines or 0.
    colour: vec4f,
    // One of so many nodes is drawn, 1 for a wet texture, length of the scene, 1 for a surface with a border.
    switches: vec4f,
    // What is behind everything, linear.
    background: vec4f,
    // Of contour lines, linear, with their opacity.
    ink: vec4f,
    // Unit vector to a window.
    window: vec4f,
}

@group(0) @binding(0) var<uniform> scene: Scene;
// Height and depth below rest, a node each.
@group(0) @binding(1) var heights: texture_2d<f32>;
@group(0) @binding(2) var scalars: texture_2d<f32>;
@group(0) @binding(3) var ramp: texture_2d<f32>;
// Share of the sky that is seen, in both directions a texel for two nodes.
@group(0) @binding(4) var openness: texture_2d<f32>;
@group(0) @binding(5) var smooth_sampler: sampler;

struct SurfacePoint {
    @builtin(position) clip: vec4f,
    @location(0) place: vec3f,
    @location(1) normal: vec3f,
    // Value of the colours, depth below rest.
    @location(2) values: vec2f,
}

fn clip_of(place: vec3f) -> vec4f {
    return scene.view_projection * vec4f(place, 1.0);
}

fn height_at(node: vec2i) -> f32 {
    return textureLoad(heights, node, 0).x;
}

// Unit normal by central differences of the heights, one-sided at the border.
fn normal_at(node: vec2i) -> vec3f {
    let last = vec2i(scene.grid.xy) - 1;
    let low = max(node - 1, vec2i(0));
    let high = min(node + 1, last);
    let run = vec2f(high - low) * scene.grid.z;
    let rise = vec2f(
        height_at(vec2i(high.x, node.y)) - height_at(vec2i(low.x, node.y)),
        height_at(vec2i(node.x, high.y)) - height_at(vec2i(node.x, low.y)),
    );
    return normalize(vec3f(-rise / run, 1.0));
}

@vertex
fn field_vertex(@builtin(vertex_index) index: u32) -> SurfacePoint {
    let columns = u32(scene.grid.x);
    let node = vec2i(i32(index % columns), i32(index / columns));
    let both = textureLoad(heights, node, 0).xy;
    var point: SurfacePoint;
    point.place = vec3f(vec2f(node) * scene.grid.z, both.x);
    point.clip = clip_of(point.place);
    point.normal = normal_at(node);
    point.values = vec2f(textureLoad(scalars, node, 0).x, both.y);
    return point;
}

@vertex
fn mesh_vertex(
    @location(0) place: vec3f,
    @location(1) normal: vec3f,
    @location(2) values: vec2f,
) -> SurfacePoint {
    var point: SurfacePoint;
    point.place = place;
    point.clip = clip_of(place);
    point.normal = normal;
    point.values = values;
    return point;
}

// The sides of the block: six vertices for each cell along the border.
@vertex
fn side_vertex(@builtin(vertex_index) index: u32) -> SurfacePoint {
    let every = i32(scene.switches.x);
    let last = vec2i(scene.grid.xy) - 1;
    let cells = (last + every - 1) / every;
    let corner = index % 6u;
    var cell = i32(index / 6u);
    let is_end = corner == 1u || corner == 2u || corner == 4u;
    let is_low = corner == 2u || corner == 4u || corner == 5u;
    let step = select(0, 1, is_end);
    var node: vec2i;
    var normal: vec3f;
    if (cell < 2 * cells.x) {
        let is_far = cell >= cells.x;
        cell = select(cell, cell - cells.x, is_far);
        node = vec2i(min((cell + step) * every, last.x), select(0, last.y, is_far));
        normal = vec3f(0.0, select(-1.0, 1.0, is_far), 0.0);
    } else {
        cell = cell - 2 * cells.x;
        let is_far = cell >= cells.y;
        cell = select(cell, cell - cells.y, is_far);
        node = vec2i(select(0, last.x, is_far), min((cell + step) * every, last.y));
        normal = vec3f(select(-1.0, 1.0, is_far), 0.0, 0.0);
    }
    var point: SurfacePoint;
    let top = height_at(node);
    point.place = vec3f(vec2f(node) * scene.grid.z, select(top, -scene.grid.w, is_low));
    point.clip = clip_of(point.place);
    point.normal = normal;
    point.values = vec2f(0.0);
    return point;
}

struct ProbePoint {
    @builtin(position) clip: vec4f,
    @location(0) place: vec3f,
    @location(1) normal: vec3f,
}

// Two unit vectors across an axis.
fn across(axis: vec3f) -> array<vec3f, 2> {
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(axis.x) > 0.7);
    let first = normalize(cross(axis, other));
    return array<vec3f, 2>(first, cross(axis, first));
}

@vertex
fn probe_vertex(@location(0) place: vec3f, @location(1) normal: vec3f) -> ProbePoint {
    let axis = scene.axis.xyz;
    let sides = across(axis);
    var point: ProbePoint;
    point.place = scene.probe.xyz + sides[0] * place.x + sides[1] * place.y + axis * place.z;
    point.clip = clip_of(point.place);
    point.normal = sides[0] * normal.x + sides[1] * normal.y + axis * normal.z;
    return point;
}

// Normals and distances for checks: w is the distance along the line of sight, negative for the probe.
@fragment
fn surface_normal(point: SurfacePoint) -> @location(0) vec4f {
    return vec4f(normalize(point.normal), 1.0 / point.clip.w);
}

@fragment
fn probe_normal(point: ProbePoint) -> @location(0) vec4f {
    return vec4f(normalize(point.normal), -1.0 / point.clip.w);
}
