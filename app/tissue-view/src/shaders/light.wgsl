// Light: a lamp, a soft sky of its own making, what the probe hides and shows.

override IS_FULL: bool = true;

const PI: f32 = 3.14159265;
const LAMP: vec3f = vec3f(1.0, 0.965, 0.92) * 2.6;
const SKY: vec3f = vec3f(0.62, 0.68, 0.76);
const GROUND: vec3f = vec3f(0.30, 0.24, 0.22);

// Radiance of the room from a direction, blurred as a surface of a roughness sees it: darker near the horizon, a round
// lamp as over an operating table, a window across from the eye.
fn room(way: vec3f, roughness: f32) -> vec3f {
    let blur = 0.02 + roughness * 0.5;
    var light = mix(GROUND * 0.8, SKY * 1.15, smoothstep(-0.25 - blur, 0.9 + blur, way.z));
    let lamp = dot(way, scene.light.xyz);
    light += LAMP * 1.6 * smoothstep(0.95 - blur, 0.97 + 0.3 * blur, lamp) / (1.0 + 5.0 * roughness);
    return light + vec3f(0.86, 0.93, 1.0) * 2.2 * window_share(way, blur) / (1.0 + 3.0 * roughness);
}

// A window of two panes, as seen in a direction.
fn window_share(way: vec3f, blur: f32) -> f32 {
    let middle = scene.window.xyz;
    let side = normalize(vec3f(middle.y, -middle.x, 0.0));
    let ahead = dot(way, middle);
    let at = vec2f(dot(way, side), dot(way, cross(side, middle))) / max(ahead, 0.05);
    let off = abs(at) - vec2f(0.15, 0.085);
    let inside = smoothstep(vec2f(0.04 + blur), vec2f(-0.04 - blur), off);
    let bar = smoothstep(0.0, 0.02 + blur, abs(at.x)) * 0.7 + 0.3;
    return select(0.0, inside.x * inside.y * bar, ahead > 0.0);
}

// What polished steel mirrors of the room: between the lights it is dark, and strips of light stand around it.
fn studio(way: vec3f, roughness: f32) -> vec3f {
    let flat_way = way.xy / max(length(way.xy), 1e-3);
    let lamp = dot(flat_way, normalize(scene.light.xy));
    let window = dot(flat_way, normalize(scene.window.xy));
    let blur = 0.015 + 0.4 * roughness;
    let level = smoothstep(0.97, 0.6, abs(way.z));
    var light = mix(vec3f(0.10, 0.11, 0.13), vec3f(0.62, 0.66, 0.72), smoothstep(-0.15, 0.95, way.z));
    light += vec3f(1.0, 0.97, 0.93) * 1.35 * level * smoothstep(0.80 - blur, 0.86 + blur, lamp);
    light += vec3f(0.84, 0.92, 1.0) * 0.8 * level * smoothstep(0.90 - blur, 0.94 + blur, window);
    light += vec3f(0.9) * 0.35 * level * smoothstep(0.84 - blur, 0.9 + blur, -lamp);
    return light + LAMP * 1.3 * smoothstep(0.94 - blur, 0.965 + blur, dot(way, scene.light.xyz));
}

// Light from the whole sky on a surface that faces a direction.
fn sky_on(normal: vec3f) -> vec3f {
    return mix(GROUND, SKY, 0.5 + 0.5 * normal.z) + vec3f(0.16, 0.17, 0.19);
}

// Schlick, "An inexpensive BRDF model for physically-based rendering", Eurographics 1994.
fn fresnel(base: vec3f, cosine: f32) -> vec3f {
    let x = clamp(1.0 - cosine, 0.0, 1.0);
    let y = x * x;
    return base + (1.0 - base) * (y * y * x);
}

// Highlight of the lamp: distribution and shadowing of GGX (Walter et al., "Microfacet models for refraction through
// rough surfaces", EGSR 2007), times the cosine.
fn highlight(way: vec3f, normal: vec3f, to_eye: vec3f, roughness: f32, base: vec3f) -> vec3f {
    let middle = normalize(way + to_eye);
    let nl = max(dot(normal, way), 0.0);
    let nv = max(dot(normal, to_eye), 1e-3);
    let nh = max(dot(normal, middle), 0.0);
    let alpha = roughness * roughness;
    let square = alpha * alpha;
    let turn = nh * nh * (square - 1.0) + 1.0;
    let distribution = square / (PI * turn * turn);
    let shade = nl * sqrt(nv * nv * (1.0 - square) + square) + nv * sqrt(nl * nl * (1.0 - square) + square);
    // The lamp is wide: its highlight has no pole.
    return fresnel(base, dot(middle, to_eye)) * min(distribution * 0.5 * nl / max(shade, 1e-4), 60.0);
}

// Share of a surface's sky, weighted by the cosine, that a sphere takes: the view factor of a plane element and a
// sphere, also where the sphere is partly below its horizon (Howell, "A catalog of radiation heat transfer configuration
// factors", B-42 and B-43).
fn sphere_share(place: vec3f, normal: vec3f, centre: vec3f, radius: f32) -> f32 {
    let to = centre - place;
    let distance = max(length(to), radius * 1.0005);
    let cosine = clamp(dot(normal, to) / distance, -0.9995, 0.9995);
    let h = distance / radius;
    let hh = h * h;
    let below = 1.0 - hh * cosine * cosine;
    if (!IS_FULL || below <= 0.0) {
        return max(cosine, 0.0) / hh;
    }
    let rim = sqrt(hh - 1.0);
    let sine = sqrt(1.0 - cosine * cosine);
    let part = cosine * acos(clamp(-cosine * rim / sine, -1.0, 1.0)) - sqrt(below) * rim;
    return clamp((part / hh + atan(sqrt(below) / rim)) / PI, 0.0, 1.0);
}

// The same for the shaft, as the sphere on it that is nearest: a bound from below, smooth along it.
fn shaft_share(place: vec3f, normal: vec3f) -> f32 {
    let offset = place - scene.probe.xyz;
    let along = clamp(dot(offset, scene.axis.xyz), 0.0, scene.axis.w);
    let to = scene.axis.xyz * along - offset;
    let distance = max(length(to), scene.shaft.x * 1.0005);
    let cosine = max(dot(normal, to) / distance, 0.0);
    return min(cosine * scene.shaft.x / distance, 1.0) * 0.6;
}

// Share of the lamp that is seen past the probe. The ray's nearest approach to the sphere and to the line of the shaft
// over the distance to it is the angle by which it passes; the lamp covers angles of a width of 0.22.
fn lamp_share(place: vec3f) -> f32 {
    let way = scene.light.xyz;
    let offset = place - scene.probe.xyz;
    let ahead = -dot(offset, way);
    var share = 1.0;
    if (ahead > 0.0) {
        let miss = sqrt(max(dot(offset, offset) - ahead * ahead, 0.0)) - scene.probe.w;
        share = smoothstep(-0.5, 0.5, miss / (0.22 * ahead));
    }
    // Nearest points of the ray and the shaft.
    let axis = scene.axis.xyz;
    let turn = dot(way, axis);
    let flat_part = max(1.0 - turn * turn, 1e-4);
    let a = dot(offset, way);
    let b = dot(offset, axis);
    let up = clamp((b - a * turn) / flat_part, 0.0, scene.axis.w);
    let out = up * turn - a;
    if (out > 0.0) {
        let miss = length(offset + way * out - axis * up) - scene.shaft.x;
        share = min(share, smoothstep(-0.5, 0.5, miss / (0.22 * out)));
    }
    return share;
}

// Where a ray meets the tip or the shaft: the distance, negative without, and the normal there.
fn meet_probe(place: vec3f, way: vec3f) -> vec4f {
    let offset = place - scene.probe.xyz;
    let a = dot(offset, way);
    let gap = a * a - dot(offset, offset) + scene.probe.w * scene.probe.w;
    if (gap > 0.0 && -a - sqrt(gap) > 0.0) {
        let out = -a - sqrt(gap);
        return vec4f((offset + way * out) / scene.probe.w, out);
    }
    let axis = scene.axis.xyz;
    let along = dot(way, axis);
    let flat_way = way - axis * along;
    let flat_from = offset - axis * dot(offset, axis);
    let square = max(dot(flat_way, flat_way), 1e-6);
    let half = dot(flat_from, flat_way);
    let inside = half * half - square * (dot(flat_from, flat_from) - scene.shaft.x * scene.shaft.x);
    if (inside > 0.0) {
        let out = (-half - sqrt(inside)) / square;
        let up = dot(offset, axis) + along * out;
        if (out > 0.0 && up > 0.0 && up < scene.axis.w) {
            return vec4f((flat_from + flat_way * out) / scene.shaft.x, out);
        }
    }
    return vec4f(0.0, 0.0, 0.0, -1.0);
}

// From linear light to what a display shows: colours below 0.8 stay as they are, brighter ones are compressed and lose
// colour (Khronos, "PBR Neutral Tone Mapper", 2024).
fn tone(light: vec3f) -> vec3f {
    let least = min(light.x, min(light.y, light.z));
    let offset = select(0.04, least - 6.25 * least * least, least < 0.08);
    var colour = light - offset;
    let start = 0.8 - 0.04;
    let peak = max(colour.x, max(colour.y, colour.z));
    if (peak < start) {
        return colour;
    }
    let room = 1.0 - start;
    let pressed = 1.0 - room * room / (peak + room - start);
    colour *= pressed / peak;
    let grey = 1.0 - 1.0 / (0.15 * (peak - pressed) + 1.0);
    return mix(colour, vec3f(pressed), grey);
}
