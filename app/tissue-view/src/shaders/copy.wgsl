// A finished picture into a rectangle of the window, enlarged smoothly where it has fewer pixels.

override IS_ENCODED: bool = false;

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) at: vec2f,
}

@vertex
fn copy_vertex(@builtin(vertex_index) index: u32) -> Corner {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u));
    var out: Corner;
    out.clip = vec4f(corner.x * 4.0 - 1.0, 1.0 - corner.y * 4.0, 0.0, 1.0);
    out.at = corner * 2.0;
    return out;
}

@fragment
fn copy_colour(corner: Corner) -> @location(0) vec4f {
    let linear = textureSampleLevel(picture, smooth_sampler, corner.at, 0.0).rgb;
    if (!IS_ENCODED) {
        return vec4f(linear, 1.0);
    }
    // The window's own format takes values as a display does (IEC 61966-2-1).
    let low = linear * 12.92;
    let high = 1.055 * pow(max(linear, vec3f(0.0)), vec3f(1.0 / 2.4)) - 0.055;
    return vec4f(select(high, low, linear <= vec3f(0.0031308)), 1.0);
}
