// Share of the sky that a node sees over the heights around it: an integral over directions of what lies below the
// horizon, weighted by the cosine to the normal (Bavoil, Sainz and Dimitrov, "Image-space horizon-based ambient
// occlusion", SIGGRAPH 2008, with the heights themselves in place of a depth buffer).

override DIRECTIONS: u32 = 8u;
override STEPS: u32 = 8u;

@group(0) @binding(0) var<uniform> scene: array<vec4f, 15>;
@group(0) @binding(1) var heights: texture_2d<f32>;

@vertex
fn whole_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u));
    return vec4f(corner * 4.0 - 1.0, 0.0, 1.0);
}

fn height_at(place: vec2f, last: vec2f) -> f32 {
    return textureLoad(heights, vec2i(clamp(round(place), vec2f(0.0), last)), 0).x;
}

@fragment
fn open_sky(@builtin(position) clip: vec4f) -> @location(0) vec4f {
    let grid = scene[6];
    let last = grid.xy - 1.0;
    let node = min(floor(clip.xy) * 2.0, last);
    let height = height_at(node, last);
    let slope = vec2f(
        height_at(node + vec2f(1.0, 0.0), last) - height_at(node - vec2f(1.0, 0.0), last),
        height_at(node + vec2f(0.0, 1.0), last) - height_at(node - vec2f(0.0, 1.0), last),
    ) / (2.0 * grid.z);
    // A fifth of the shorter side; steps grow, so that near walls count in detail.
    let reach = 0.2 * min(last.x, last.y);
    var hidden = 0.0;
    for (var direction = 0u; direction < DIRECTIONS; direction++) {
        let angle = 6.2831853 * (f32(direction) + 0.5) / f32(DIRECTIONS);
        let way = vec2f(cos(angle), sin(angle));
        let tangent = dot(slope, way);
        var steepest = tangent;
        for (var step = 1u; step <= STEPS; step++) {
            let share = f32(step) / f32(STEPS);
            let length = max(reach * share * share, f32(step));
            let rise = height_at(node + way * length, last) - height;
            // Far walls fade: light comes from beyond them too.
            let fade = 1.0 - 0.5 * share;
            steepest = max(steepest, mix(tangent, rise / (length * grid.z), fade));
        }
        let horizon = steepest * steepest / (1.0 + steepest * steepest);
        let own = tangent * tangent / (1.0 + tangent * tangent);
        hidden += max(select(0.0, horizon, steepest > 0.0) - select(0.0, own, tangent > 0.0), 0.0);
    }
    return vec4f(1.0 - hidden / f32(DIRECTIONS));
}
