// The look of tissue, of the sides of its block and of the probe.

// Colour of the mucosa of a stomach, linear.
const TISSUE: vec3f = vec3f(0.56, 0.135, 0.105);
// How far light goes round into the shade, for red, green and blue: red goes furthest under skin (d'Eon and Luebke,
// "Advanced techniques for realistic real-time skin rendering", GPU Gems 3, 2007).
const ROUND: vec3f = vec3f(0.42, 0.16, 0.12);
// Reflectance of water, and of steel.
const WATER: vec3f = vec3f(0.022);
const STEEL: vec3f = vec3f(0.60, 0.585, 0.57);
const GLOVE: vec3f = vec3f(0.09, 0.20, 0.42);

fn scramble(cell: vec2i) -> f32 {
    var bits = bitcast<u32>(cell.x) * 0x9e3779b1u ^ bitcast<u32>(cell.y) * 0x85ebca77u;
    bits = (bits ^ (bits >> 15u)) * 0x2c1b3c6du;
    bits = (bits ^ (bits >> 12u)) * 0x297a2d39u;
    return f32((bits ^ (bits >> 15u)) >> 8u) / 16777216.0;
}

// Value noise, 0 to 1, and its slope.
fn noise(place: vec2f) -> vec3f {
    let cell = vec2i(floor(place));
    let at = fract(place);
    let ease = at * at * (3.0 - 2.0 * at);
    let slope = 6.0 * at * (1.0 - at);
    let a = scramble(cell);
    let b = scramble(cell + vec2i(1, 0));
    let c = scramble(cell + vec2i(0, 1));
    let d = scramble(cell + vec2i(1, 1));
    let mixed = a - b - c + d;
    return vec3f(
        a + (b - a) * ease.x + (c - a) * ease.y + mixed * ease.x * ease.y,
        slope * vec2f(b - a + mixed * ease.y, c - a + mixed * ease.x),
    );
}

struct Texture {
    // Added to the slope of the surface.
    slope: vec2f,
    colour: vec3f,
}

// Moisture and vessels: no data, and off where colours are. `pixel` is the length of a pixel in mm.
fn wet_texture(place: vec2f, pixel: f32) -> Texture {
    let size = scene.switches.z / 60.0;
    let at = place / size;
    var found: Texture;
    let large = noise(at * 0.16 + 3.0);
    let middle = noise(at * 0.55 + 11.0 + large.yz);
    let fine = noise(at * 1.9 + 0.8 * middle.yz);
    let pores = noise(at * 5.2);
    let visible = clamp(1.0 - pixel / size * 2.2, 0.0, 1.0);
    found.slope = 0.055 * large.yz * 0.35 + 0.050 * middle.yz + 0.055 * fine.yz * visible
        + 0.030 * pores.yz * visible * visible;
    // Vessels run where two kinds of noise are equal; they come and go.
    let bent = at + 2.6 * vec2f(middle.x, large.x) + 0.5 * fine.yz;
    let ridge = abs(noise(bent * 0.16 + 7.0).x - noise(bent * 0.13 + 29.0).x);
    let twig = abs(noise(bent * 0.45 + 41.0).x - noise(bent * 0.39 + 3.0).x);
    let thick = smoothstep(0.25, 0.75, noise(at * 0.3 + 17.0).x);
    let vessel = smoothstep(0.075, 0.0, ridge) * 0.42 * thick + smoothstep(0.09, 0.0, twig) * 0.20 * (1.0 - thick);
    let pale = clamp(large.x * 0.7 + middle.x * 0.45 - 0.08, 0.0, 1.0);
    let blush = mix(vec3f(0.86, 0.68, 0.66), vec3f(1.10, 1.62, 1.55), pale);
    found.colour = blush * mix(vec3f(1.0), vec3f(0.62, 0.30, 0.42), vessel) * (0.92 + 0.16 * fine.x);
    return found;
}

struct Skin {
    // To be taken from the normal.
    tilt: vec3f,
    colour: vec3f,
}

// The texture along z, on a mesh along the axis that the surface faces, mixed where it faces two.
fn wet_skin(place: vec3f, normal: vec3f, pixel: f32) -> Skin {
    var skin: Skin;
    if (scene.switches.w > 0.5) {
        let found = wet_texture(place.xy, pixel);
        skin.tilt = vec3f(found.slope, 0.0);
        skin.colour = found.colour;
        return skin;
    }
    var shares = normal * normal * normal * normal;
    shares = max(shares / (shares.x + shares.y + shares.z) - 0.08, vec3f(0.0));
    shares /= shares.x + shares.y + shares.z;
    if (shares.x > 0.0) {
        let found = wet_texture(place.yz + 57.0, pixel);
        skin.tilt += shares.x * vec3f(0.0, found.slope);
        skin.colour += shares.x * found.colour;
    }
    if (shares.y > 0.0) {
        let found = wet_texture(place.zx + 131.0, pixel);
        skin.tilt += shares.y * vec3f(found.slope.y, 0.0, found.slope.x);
        skin.colour += shares.y * found.colour;
    }
    if (shares.z > 0.0) {
        let found = wet_texture(place.xy, pixel);
        skin.tilt += shares.z * vec3f(found.slope, 0.0);
        skin.colour += shares.z * found.colour;
    }
    return skin;
}

fn ramp_at(value: f32) -> vec3f {
    let share = clamp((value - scene.colour.x) / (scene.colour.y - scene.colour.x), 0.0, 1.0) * 255.0;
    let low = i32(floor(share));
    let first = textureLoad(ramp, vec2i(low, 0), 0).rgb;
    return mix(first, textureLoad(ramp, vec2i(min(low + 1, 255), 0), 0).rgb, fract(share));
}

// What hides light in a fold returns some of it in its own colour (Jimenez et al., "Practical real-time strategies for
// accurate indirect occlusion", SIGGRAPH 2016 courses: their fit).
fn coloured(open: f32, colour: vec3f) -> vec3f {
    let a = 2.0404 * colour - 0.3324;
    let b = -4.7951 * colour + 0.6417;
    let c = 2.7552 * colour + 0.6903;
    return max(vec3f(open), ((open * a + b) * open + c) * open);
}

// Lines of equal depth, two pixels wide.
fn contour(depth: f32) -> f32 {
    let interval = scene.colour.w;
    let lines = depth / max(interval, 1e-6);
    let width = max(fwidth(lines), 1e-6);
    let off = abs(fract(lines - 0.5) - 0.5) / width;
    let is_line = interval > 0.0 && depth > 0.5 * interval && width < 0.5;
    return select(0.0, (1.0 - smoothstep(0.5, 1.5, off)) * scene.ink.a, is_line);
}

// Share of the sky that is seen. On a mesh it is a guess from the depth: the walls of a dent of 45 degrees hide 0.29 of it on
// the average (1 - sin 45 degrees), more further down.
fn open_at(place: vec3f, depth: f32) -> f32 {
    if (scene.switches.w < 0.5) {
        let down = max(depth, 0.0);
        return 1.0 - 0.58 * down / (down + 0.02 * scene.switches.z);
    }
    let size = vec2f(textureDimensions(openness));
    let at = (place.xy / scene.grid.z / 2.0 + 0.5) / size;
    return textureSampleLevel(openness, smooth_sampler, at, 0.0).x;
}

// Light through moist tissue: diffuse light that goes round, all of it in linear units.
fn soft_light(normal: vec3f, lamp: f32, open: f32, colour: vec3f) -> vec3f {
    let facing = dot(normal, scene.light.xyz);
    let bent = clamp((facing + ROUND) / (1.0 + ROUND), vec3f(0.0), vec3f(1.0));
    // A shadow's edge is red for the same reason.
    let shadow = vec3f(lamp) + vec3f(0.25, -0.04, -0.08) * lamp * (1.0 - lamp);
    return colour * (LAMP * 0.36 * bent * shadow + sky_on(normal) * 0.62 * coloured(open, colour));
}

@fragment
fn tissue_colour(point: SurfacePoint, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    // An open mesh has an inner side.
    let smooth_normal = normalize(point.normal) * select(-1.0, 1.0, is_front);
    let from_eye = point.place - scene.eye.xyz;
    let distance = length(from_eye);
    let to_eye = -from_eye / distance;
    var near_share = 0.0;
    var lamp = 1.0;
    if (scene.shaft.y > 0.5) {
        near_share = sphere_share(point.place, smooth_normal, scene.probe.xyz, scene.probe.w);
        near_share = 1.0 - (1.0 - near_share) * (1.0 - shaft_share(point.place, smooth_normal));
        lamp = lamp_share(point.place);
    }
    let fold = open_at(point.place, point.values.y);
    let open = fold * (1.0 - near_share);
    let line = contour(point.values.y);
    if (scene.colour.z > 0.5) {
        // Colours that are data keep their hue: less light and shade, no highlights, no tone curve.
        let facing = clamp(0.5 + 0.5 * dot(smooth_normal, scene.light.xyz), 0.0, 1.0);
        let shade = (0.50 + 0.50 * facing) * (0.55 + 0.45 * open) * (0.75 + 0.25 * lamp);
        return vec4f(mix(ramp_at(point.values.x) * shade, scene.ink.rgb, line), 1.0);
    }
    var normal = smooth_normal;
    var colour = TISSUE;
    if (IS_FULL && scene.switches.y > 0.5) {
        let skin = wet_skin(point.place, smooth_normal, distance / scene.eye.w);
        normal = normalize(smooth_normal - skin.tilt);
        colour *= skin.colour;
    }
    var light = soft_light(normal, lamp, open, colour);
    light += wet_light(point.place, normal, to_eye, lamp, fold, near_share);
    return vec4f(mix(tone(light), scene.ink.rgb, line), 1.0);
}

// What the film of water returns: the lamp in it, the room, and the probe.
fn wet_light(place: vec3f, normal: vec3f, to_eye: vec3f, lamp: f32, fold: f32, near_share: f32) -> vec3f {
    let mirrored = fresnel(WATER, max(dot(normal, to_eye), 0.0));
    if (!IS_FULL) {
        // The window alone, wider than it is.
        let middle = normalize(scene.window.xyz + to_eye);
        let turn = max(dot(middle, normal), 0.0);
        let eight = turn * turn * turn * turn * turn * turn * turn * turn;
        return mirrored * (0.6 * SKY + vec3f(3.4, 3.6, 3.8) * eight * eight * eight * eight * eight * eight * lamp) * fold;
    }
    let shine = highlight(scene.light.xyz, normal, to_eye, 0.40, WATER);
    var light = LAMP * lamp * (shine + highlight(scene.light.xyz, normal, to_eye, 0.2, WATER) * 1.5);
    var way = reflect(-to_eye, normal);
    if (scene.switches.w > 0.5) {
        way = normalize(vec3f(way.xy, max(way.z, 0.02)));
    }
    var seen = room(way, 0.05) + vec3f(0.9, 0.95, 1.0) * 9.0 * window_share(way, 0.04);
    if (scene.shaft.y > 0.5) {
        let met = meet_probe(place + normal * 0.01, way);
        if (met.w > 0.0) {
            let base = select(STEEL, GLOVE * 0.3, scene.shaft.z > 0.5);
            seen = base * studio(reflect(way, met.xyz), 0.2);
        } else {
            seen *= 1.0 - 0.8 * near_share;
        }
    }
    return light + mirrored * seen * fold * fold;
}

@fragment
fn side_colour(point: SurfacePoint) -> @location(0) vec4f {
    let low = clamp(-point.place.z / max(scene.grid.w, 1e-3), 0.0, 1.0);
    if (scene.colour.z > 0.5) {
        let grey = mix(vec3f(0.16), scene.background.rgb, 0.35 + 0.25 * low);
        return vec4f(grey, 1.0);
    }
    let normal = normalize(point.normal);
    let colour = TISSUE * mix(vec3f(1.05, 1.35, 1.30), vec3f(0.80, 0.72, 0.74), sqrt(low));
    let light = soft_light(normal, 1.0, 0.95 - 0.35 * low, colour) * 0.85;
    return vec4f(tone(light), 1.0);
}

// The tissue as the probe's surface mirrors it: in the contact's own shade it is dark and red.
fn ground_light(lit: f32, value: f32) -> vec3f {
    if (scene.colour.z > 0.5) {
        return ramp_at(value) * (0.15 + 0.6 * lit);
    }
    return TISSUE * mix(vec3f(0.16, 0.07, 0.06), vec3f(1.15, 1.3, 1.3), lit);
}

// What the probe's surface mirrors: the tissue below it, or the room.
fn around_probe(place: vec3f, way: vec3f, roughness: f32) -> vec3f {
    let high = studio(way, roughness);
    if (scene.switches.w < 0.5) {
        // The tissue below is a plane.
        let sink = -dot(way, scene.grid.xyz);
        let fall = max(dot(place, scene.grid.xyz) - scene.grid.w, 0.0) / max(sink, 0.02);
        let lit = smoothstep(0.0, 1.8 * scene.probe.w, fall);
        let seen = smoothstep(8.0, 2.0, fall / scene.probe.w) * smoothstep(0.0, 0.12, sink);
        return mix(high, ground_light(lit, scene.colour.x), seen);
    }
    if (way.z > 0.0) {
        return high;
    }
    let down = max(-way.z, 0.02);
    let last = (scene.grid.xy - 1.0) * scene.grid.z;
    var hit = place.xy + way.xy * (max(place.z, 0.0) / down);
    let node = vec2i(clamp(hit / scene.grid.z, vec2f(0.0), scene.grid.xy - 1.0));
    let fall = max(place.z - height_at(node), 0.0) / down;
    hit = place.xy + way.xy * fall;
    let edge = 0.03 * scene.switches.z + 0.25 * fall;
    let inside = smoothstep(vec2f(-edge), vec2f(edge), min(hit, last - hit));
    let lit = smoothstep(0.0, 1.8 * scene.probe.w, fall);
    let seen = vec2i(clamp(hit / scene.grid.z + 0.5, vec2f(0.0), scene.grid.xy - 1.0));
    let tissue = ground_light(lit, textureLoad(scalars, seen, 0).x);
    return mix(high, tissue, inside.x * inside.y * smoothstep(0.0, 0.12, -way.z));
}

@fragment
fn probe_colour(point: ProbePoint) -> @location(0) vec4f {
    let normal = normalize(point.normal);
    let to_eye = normalize(scene.eye.xyz - point.place);
    let cosine = max(dot(normal, to_eye), 0.0);
    // Low on the tip the tissue is near and hides the room.
    var gap = 1e6;
    var up = 1.0;
    if (scene.switches.w > 0.5) {
        let node = vec2i(clamp(point.place.xy / scene.grid.z + 0.5, vec2f(0.0), scene.grid.xy - 1.0));
        gap = point.place.z - height_at(node);
        up = normal.z;
    } else if (dot(scene.grid.xyz, scene.grid.xyz) > 0.5) {
        gap = dot(point.place, scene.grid.xyz) - scene.grid.w;
        up = dot(normal, scene.grid.xyz);
    }
    let near = max(gap, 0.0) / max(scene.probe.w, 1e-3);
    let open = mix(0.3, 1.0, clamp(near * 1.3 + 0.25 * max(up, 0.0), 0.0, 1.0));
    let way = reflect(-to_eye, normal);
    if (scene.shaft.z > 0.5) {
        let facing = dot(normal, scene.light.xyz);
        let wrapped = clamp((facing + 0.25) / 1.25, 0.0, 1.0);
        let gloss = highlight(scene.light.xyz, normal, to_eye, 0.42, vec3f(0.04));
        var light = GLOVE * (LAMP * 0.36 * wrapped + sky_on(normal) * 0.62 * open);
        light += LAMP * gloss + fresnel(vec3f(0.04), cosine) * room(way, 0.5) * 0.6 * open;
        return vec4f(tone(light), 1.0);
    }
    let light = fresnel(STEEL, cosine) * around_probe(point.place, way, 0.08) * open * 1.25;
    return vec4f(tone(light), 1.0);
}
