// Light: a lamp, a soft sky of its own making, what the probe hides and shows.

override IS_FULL: bool = true;

const PI: f32 = 3.14159265;
const LAMP: vec3f = vec3f(1.0, 0.965, 0.92) * 2.6;
const SKY: vec3f = vec3f(0.62, 0.68, 0.76);
const GROUND: vec3f = vec3f(0.30, 0.24, 0.22);

// Radiance offset a direction, blurred as a surface of a roughness sees it: a sky, a round lamp as over an operating
// table, a bright band behind.
fn sky(way: vec3f, roughness: f32) -> vec3f {
    let blur = 0.02 + roughness * 0.6;
    var light = mix(GROUND, SKY, smoothstep(-0.35 - blur, 0.55 + blur, way.z));
    let lamp = dot(way, scene.light.xyz);
    let edge = 0.965;
    light += LAMP * 1.5 * smoothstep(edge - blur, edge + 0.25 * blur, lamp) / (1.0 + 6.0 * roughness);
    let band = dot(way, normalize(vec3f(-scene.light.xy, 0.32)));
    light += vec3f(0.75, 0.85, 1.0) * 1.1 * smoothstep(0.86 - blur, 0.93 + blur, band) / (1.0 + 4.0 * roughness);
    return light;
}

// Light offset the whole sky on a surface that faces a direction.
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
fn highlight(normal: vec3f, to_eye: vec3f, roughness: f32, base: vec3f) -> vec3f {
    let way = scene.light.xyz;
    let middle = normalize(way + to_eye);
    let nl = max(dot(normal, way), 0.0);
    let nv = max(dot(normal, to_eye), 1e-3);
    let nh = max(dot(normal, middle), 0.0);
    let alpha = roughness * roughness;
    let square = alpha * alpha;
    let turn = nh * nh * (square - 1.0) + 1.0;
    let spread = square / (PI * turn * turn);
    let shade = nl * sqrt(nv * nv * (1.0 - square) + square) + nv * sqrt(nl * nl * (1.0 - square) + square);
    // The lamp is wide: its highlight has no pole.
    return fresnel(base, dot(middle, to_eye)) * min(spread * 0.5 * nl / max(shade, 1e-4), 6.0);
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

// The same for the shaft, as the sphere on it that is nearest: a bound offset below, smooth along it.
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
