//! Areas with zones, holes and fences for tests of planners, each by its seed: shapes that
//! planners find hard, alone and together.
//!
//! The same seed gives the same site everywhere. Every ring of a site is simple; that there is
//! a plan is not promised.

use crate::ground::{Ground, Named};
use crate::outline::{Outline, Ring, RingError};
use crate::plane::{Plane, Point};
use core::f64::consts::{FRAC_PI_2, TAU};
use libm::sincos;
use serde_json::{Value, json};

/// Tries for a part of a site before it is left out.
const TRIES: usize = 40;

/// Where all sites are.
pub const PLANE: Plane = Plane {
    lat_deg: 47.4,
    lon_deg: 8.55,
};

/// Numbers by a seed.
struct Draw(u64);

impl Draw {
    /// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    #[allow(clippy::cast_precision_loss, reason = "53 bits fit")]
    fn between(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.bits() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }

    /// Small ones as likely as large ones.
    fn scale(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.between(libm::log(low), libm::log(high)))
    }

    #[allow(clippy::cast_possible_truncation, reason = "below n")]
    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }

    fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }
}

type Corners = Vec<Point>;

fn corners(points: &[(f64, f64)]) -> Corners {
    points.iter().map(|(x, y)| Point::new(*x, *y)).collect()
}

fn rectangle(x: f64, y: f64, wide: f64, high: f64) -> Corners {
    corners(&[(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)])
}

fn moved(ring: &[Point], turn_rad: f64, to: Point) -> Corners {
    let (s, c) = sincos(turn_rad);
    let each = ring.iter();
    each.map(|p| Point::new(to.x + c * p.x - s * p.y, to.y + s * p.x + c * p.y))
        .collect()
}

/// Spokes of drawn lengths at even or drawn angles.
fn star(draw: &mut Draw, n: usize, low_m: f64, high_m: f64) -> Corners {
    #[allow(clippy::cast_precision_loss, reason = "a few corners")]
    let step = TAU / n as f64;
    let mut at = 0.0;
    let mut out = Vec::new();
    for _ in 0..n {
        let (s, c) = sincos(at + draw.between(0.0, 0.8 * step));
        let r = draw.between(low_m, high_m);
        out.push(Point::new(r * c, r * s));
        at += step;
    }
    out
}

/// Corners on an ellipse.
fn convex(draw: &mut Draw, wide_m: f64, high_m: f64) -> Corners {
    let n = 3 + draw.below(8);
    let round = star(draw, n, 1.0, 1.0 + 1e-9);
    let each = round.iter();
    each.map(|p| Point::new(p.x * wide_m / 2.0, p.y * high_m / 2.0))
        .collect()
}

/// How a team flies over a site.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manner {
    /// How many UAVs.
    pub n_uavs: usize,
    /// Width of the ground that each sees, metres.
    pub swath_m: f64,
    /// Turn radius, metres.
    pub turn_radius_m: f64,
    /// Distance from zones and fences, metres.
    pub clearance_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// How far a camera sees before and behind, metres; half the swath by default.
    pub look_ahead_m: Option<f64>,
}

/// An area with what belongs to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// Its seed.
    pub seed: u64,
    /// What it is made of, for a person.
    pub kind: String,
    /// The area.
    pub area: Vec<Point>,
    /// Its holes.
    pub holes: Vec<Vec<Point>>,
    /// Zones to be kept out of.
    pub zones: Vec<Vec<Point>>,
    /// Fences to be stayed within.
    pub fences: Vec<Vec<Point>>,
    /// Where all UAVs start.
    pub launch: Point,
    /// How it is flown.
    pub manner: Manner,
}

/// Shapes of areas.
const AREAS: [&str; 11] = [
    "rectangle",
    "convex",
    "concave",
    "U",
    "L",
    "needle",
    "sliver",
    "rooms",
    "comb",
    "cross",
    "spiral",
];

/// Arrangements of zones.
const ZONES: [&str; 9] = [
    "no zones",
    "blobs",
    "pocket",
    "ring",
    "gapped ring",
    "corridor",
    "border",
    "needles",
    "slalom",
];

impl Site {
    /// The site of a seed.
    #[must_use]
    pub fn of(seed: u64) -> Self {
        let mut draw = Draw(seed.wrapping_mul(0x2545_F491_4F6C_DD1D) ^ 0x5EED);
        let swath_m = draw.scale(15.0, 120.0);
        let manner = Manner {
            n_uavs: 1 + draw.below(4),
            swath_m,
            turn_radius_m: draw.scale(5.0, 80.0),
            clearance_m: draw.of(&[0.0, 1.0, 5.0, 10.0, 10.0, 25.0]),
            speed_mps: draw.between(8.0, 25.0),
            look_ahead_m: draw.of(&[None, None, Some(0.0), Some(swath_m / 4.0)]),
        };
        let size_m = draw.scale(150.0, 1500.0);
        let kind = draw.of(&AREAS);
        let turn_rad = draw.of(&[0.0, 0.0, FRAC_PI_2 / 2.0, draw_angle(seed)]);
        let mut site = Self {
            seed,
            kind: kind.to_owned(),
            area: rectangle(0.0, 0.0, size_m, size_m),
            holes: Vec::new(),
            zones: Vec::new(),
            fences: Vec::new(),
            launch: Point::default(),
            manner,
        };
        for _ in 0..TRIES {
            let ring = area(&mut draw, kind, size_m, &manner);
            let ring = moved(&ring, turn_rad, Point::default());
            if Ring::new(ring.clone()).is_ok_and(|r| r.area_m2() > 100.0) {
                site.area = ring;
                break;
            }
        }
        for _ in 0..1 + draw.below(2) {
            let kind = draw.of(&ZONES);
            site.kind = format!("{}, {kind}", site.kind);
            let found = zones(&mut draw, kind, &site.area, size_m, &manner);
            let simple = found.into_iter().filter(|z| Ring::new(z.clone()).is_ok());
            site.zones.extend(simple);
        }
        if draw.one_in(4) {
            site.kind.push_str(", holes");
            site.add_holes(&mut draw, size_m);
        }
        if draw.one_in(4) {
            site.add_fence(&mut draw, size_m);
        }
        site.launch = site.launch_place(&mut draw, size_m);
        site
    }

    /// Holes inside of the area and apart from each other.
    fn add_holes(&mut self, draw: &mut Draw, size_m: f64) {
        for _ in 0..1 + draw.below(2) {
            for _ in 0..TRIES {
                let n = 3 + draw.below(5);
                let shape = star(draw, n, 0.02 * size_m, 0.15 * size_m);
                let at = inside(draw, &self.area);
                let hole = moved(&shape, 0.0, at);
                let (Ok(ring), Ok(area)) = (Ring::new(hole.clone()), Ring::new(self.area.clone()))
                else {
                    continue;
                };
                let (ring, area) = (Outline::Ring(ring), Outline::Ring(area));
                let others = self.holes.iter().flatten();
                let fits = hole.iter().all(|p| area.contains(*p))
                    && self.area.iter().all(|p| !ring.contains(*p))
                    && !borders_meet(&hole, &self.area)
                    && others.into_iter().all(|p| !ring.contains(*p))
                    && self.holes.iter().all(|h| !borders_meet(&hole, h));
                if fits {
                    self.holes.push(hole);
                    break;
                }
            }
        }
    }

    fn add_fence(&mut self, draw: &mut Draw, size_m: f64) {
        let (low, high) = bounds(&self.area);
        let turn_m = 4.0 * self.manner.turn_radius_m + self.manner.clearance_m;
        let (kind, ring) = match draw.below(4) {
            0 => {
                let by = turn_m + self.manner.swath_m;
                ("wide fence", around(low, high, by))
            }
            1 => (
                "tight fence",
                around(low, high, 1.1 * self.manner.clearance_m),
            ),
            2 => {
                // A slot from above down into the middle of the area's box.
                let by = turn_m;
                let half_m = draw.between(0.02, 0.15) * size_m;
                let x = draw.between(low.x, high.x);
                let down = draw.between(low.y, high.y);
                let (l, r) = (low.x - by - half_m, high.x + by + half_m);
                let (b, t) = (low.y - by, high.y + by);
                let u = [
                    (l, b),
                    (r, b),
                    (r, t),
                    (x + half_m, t),
                    (x + half_m, down),
                    (x - half_m, down),
                    (x - half_m, t),
                    (l, t),
                ];
                ("U fence", corners(&u))
            }
            _ => {
                let middle = Point::new((low.x + high.x) / 2.0, (low.y + high.y) / 2.0);
                let shape = convex(draw, 1.6 * size_m, 1.6 * size_m);
                ("cutting fence", moved(&shape, 0.0, middle))
            }
        };
        if Ring::new(ring.clone()).is_ok() {
            self.kind = format!("{}, {kind}", self.kind);
            self.fences.push(ring);
        }
    }

    fn launch_place(&self, draw: &mut Draw, size_m: f64) -> Point {
        match draw.below(4) {
            0 => self.area[draw.below(self.area.len())],
            1 => inside(draw, &self.area),
            _ => {
                let (low, high) = bounds(&self.area);
                let by = 0.3 * size_m;
                Point::new(
                    draw.between(low.x - by, high.x + by),
                    draw.between(low.y - by, high.y + by),
                )
            }
        }
    }

    /// The site for a recount, its holes kept out of.
    ///
    /// # Errors
    /// When a ring was changed to be none.
    pub fn ground(&self) -> Result<Ground, RingError> {
        let all = |rings: &[Vec<Point>], what: &str| -> Result<Vec<Named>, RingError> {
            let each = rings.iter().enumerate();
            each.map(|(i, ring)| {
                Ok(Named {
                    name: format!("{what}{}", i + 1),
                    outline: Outline::Ring(Ring::new(ring.clone())?),
                })
            })
            .collect()
        };
        Ok(Ground {
            areas: all(core::slice::from_ref(&self.area), "area ")?,
            holes: all(&self.holes, "")?,
            zones: all(&self.zones, "")?,
            fences: all(&self.fences, "fence ")?,
            notices: Vec::new(),
        })
    }

    /// The site as GeoJSON; fences have no place there.
    #[must_use]
    pub fn geojson(&self) -> Value {
        let ring = |ring: &[Point]| -> Value {
            let closed = ring.iter().chain(ring.first());
            closed
                .map(|p| PLANE.place(*p))
                .map(|at| json!([at.lon_deg, at.lat_deg]))
                .collect()
        };
        let feature = |rings: Vec<Value>, properties: Value| {
            json!({"type": "Feature", "properties": properties,
                "geometry": {"type": "Polygon", "coordinates": rings}})
        };
        let outer = core::iter::once(&self.area);
        let area = outer.chain(&self.holes).map(|r| ring(r)).collect();
        let name = format!("seed {}: {}", self.seed, self.kind);
        let mut features = vec![feature(area, json!({"name": name}))];
        let zones = self.zones.iter();
        features.extend(zones.map(|z| feature(vec![ring(z)], json!({"no_fly": true}))));
        json!({"type": "FeatureCollection", "features": features})
    }

    /// The site as a QGroundControl plan; holes are exclusion fences.
    #[must_use]
    pub fn plan(&self) -> Value {
        let pair = |p: &Point| {
            let at = PLANE.place(*p);
            json!([at.lat_deg, at.lon_deg])
        };
        let ring = |r: &[Point]| r.iter().map(pair).collect::<Value>();
        let fence = |r: &Vec<Point>, inclusion: bool| json!({"inclusion": inclusion, "polygon": ring(r), "version": 1});
        let out = self.zones.iter().chain(&self.holes);
        let polygons = out
            .map(|r| fence(r, false))
            .chain(self.fences.iter().map(|r| fence(r, true)));
        json!({
            "fileType": "Plan", "version": 1, "groundStation": "skein",
            "geoFence": {"circles": [], "polygons": polygons.collect::<Vec<_>>(), "version": 2},
            "mission": {
                "version": 2, "cruiseSpeed": self.manner.speed_mps, "hoverSpeed": 5,
                "firmwareType": 12, "vehicleType": 1, "plannedHomePosition": pair(&self.launch),
                "items": [{"type": "ComplexItem", "complexItemType": "survey", "version": 3,
                    "polygon": ring(&self.area)}],
            },
            "rallyPoints": {"points": [], "version": 2},
        })
    }
}

/// An angle that is no share of a turn.
fn draw_angle(seed: u64) -> f64 {
    Draw(seed ^ 0xA461).between(0.0, TAU)
}

fn bounds(ring: &[Point]) -> (Point, Point) {
    let all = crate::boxes::Bounds::of(ring);
    (all.low, all.high)
}

fn around(low: Point, high: Point, by: f64) -> Corners {
    let (wide, high_m) = (high.x - low.x, high.y - low.y);
    rectangle(low.x - by, low.y - by, wide + 2.0 * by, high_m + 2.0 * by)
}

/// Some point inside of a ring, or its first corner.
fn inside(draw: &mut Draw, ring: &[Point]) -> Point {
    let (low, high) = bounds(ring);
    if let Ok(checked) = Ring::new(ring.to_vec()) {
        let outline = Outline::Ring(checked);
        for _ in 0..TRIES {
            let p = Point::new(draw.between(low.x, high.x), draw.between(low.y, high.y));
            if outline.contains(p) {
                return p;
            }
        }
    }
    ring.first().copied().unwrap_or_default()
}

fn borders_meet(a: &[Point], b: &[Point]) -> bool {
    let edges = |r: &[Point]| {
        let n = r.len();
        (0..n).map(|i| (r[i], r[(i + 1) % n])).collect::<Vec<_>>()
    };
    let others = edges(b);
    edges(a).iter().any(|(p, q)| {
        let path = crate::path::Path::line(*p, *q);
        others
            .iter()
            .any(|(c, d)| path.to_segment(*c, *d).distance_m < 1.0)
    })
}

fn area(draw: &mut Draw, kind: &str, size: f64, manner: &Manner) -> Corners {
    let swath = manner.swath_m;
    match kind {
        "rectangle" => rectangle(0.0, 0.0, size, size * draw.between(0.2, 1.0)),
        "convex" => {
            let high_m = size * draw.between(0.3, 1.0);
            convex(draw, size, high_m)
        }
        "concave" => {
            let n = 5 + draw.below(9);
            star(draw, n, 0.15 * size, 0.6 * size)
        }
        "U" => {
            let (a, b) = (draw.between(0.1, 0.45), draw.between(0.55, 0.9));
            let floor = draw.between(0.05, 0.6);
            corners(&[
                (0.0, 0.0),
                (size, 0.0),
                (size, size),
                (b * size, size),
                (b * size, floor * size),
                (a * size, floor * size),
                (a * size, size),
                (0.0, size),
            ])
        }
        "L" => {
            let (a, b) = (draw.between(0.05, 0.8), draw.between(0.05, 0.8));
            corners(&[
                (0.0, 0.0),
                (size, 0.0),
                (size, b * size),
                (a * size, b * size),
                (a * size, size),
                (0.0, size),
            ])
        }
        "needle" => {
            let wide = draw.scale(1.0, 2.0 * swath);
            corners(&[(0.0, 0.0), (size, wide / 2.0), (0.0, wide)])
        }
        "sliver" => {
            let wide = draw.scale(0.5, 1.5 * swath);
            corners(&[
                (0.0, 0.0),
                (size, 0.0),
                (size + wide, wide),
                (0.1 * wide, wide),
            ])
        }
        "rooms" => {
            // Two rooms with a passage of about a lane between them.
            let wide = swath * draw.of(&[0.5, 0.99, 1.0, 1.01, 1.5, 2.2]);
            let (room, way) = (0.4 * size, draw.between(0.2, 0.8) * size);
            let y = draw.between(0.0, (room - wide).max(0.0));
            let top = (y + wide).min(room * 0.999);
            corners(&[
                (0.0, 0.0),
                (room, 0.0),
                (room, y.max(0.001)),
                (room + way, y.max(0.001)),
                (room + way, 0.0),
                (2.0 * room + way, 0.0),
                (2.0 * room + way, room),
                (room + way, room),
                (room + way, top),
                (room, top),
                (room, room),
                (0.0, room),
            ])
        }
        "comb" => {
            let teeth = 2 + draw.below(4);
            #[allow(clippy::cast_precision_loss, reason = "a few teeth")]
            let pitch = size / teeth as f64;
            let (thick, back) = (
                pitch * draw.between(0.15, 0.85),
                size * draw.between(0.05, 0.4),
            );
            let mut out = corners(&[(size, 0.0), (size, back)]);
            let mut x = size;
            for _ in 0..teeth {
                x -= pitch;
                out.extend(corners(&[
                    (x + thick, back),
                    (x + thick, size),
                    (x, size),
                    (x, back),
                ]));
            }
            out.dedup_by(|a, b| a.distance(*b) < 0.01);
            out.push(Point::new(0.0, 0.0));
            out
        }
        "cross" => {
            let (a, b) = (draw.between(0.1, 0.45), draw.between(0.1, 0.45));
            let (l, r, d, u) = (a * size, (1.0 - a) * size, b * size, (1.0 - b) * size);
            corners(&[
                (l, 0.0),
                (r, 0.0),
                (r, d),
                (size, d),
                (size, u),
                (r, u),
                (r, size),
                (l, size),
                (l, u),
                (0.0, u),
                (0.0, d),
                (l, d),
            ])
        }
        _ => spiral(draw, size),
    }
}

/// A band that winds inwards by squares.
fn spiral(draw: &mut Draw, size: f64) -> Corners {
    let band = size * draw.between(0.08, 0.16);
    let gap = size * draw.between(0.02, 0.1);
    let pitch = band + gap;
    let outer = corners(&[
        (0.0, 0.0),
        (size, 0.0),
        (size, size),
        (0.0, size),
        (0.0, pitch),
        (size - pitch, pitch),
        (size - pitch, size - pitch),
        (pitch, size - pitch),
    ]);
    let inner = corners(&[
        (pitch, size - pitch - band),
        (size - pitch - band, size - pitch - band),
        (size - pitch - band, pitch + band),
        (band, pitch + band),
        (band, size - band),
        (size - band, size - band),
        (size - band, band),
        (0.0, band),
    ]);
    // The first edge of the band is cut open at its beginning.
    let mut out = outer;
    out.extend(inner);
    out
}

fn zones(draw: &mut Draw, kind: &str, area: &[Point], size: f64, manner: &Manner) -> Vec<Corners> {
    let at = inside(draw, area);
    let turn_rad = draw.of(&[0.0, draw_angle(draw_seed(at))]);
    let lane_m = manner.swath_m + 2.0 * manner.clearance_m;
    let room_m = draw.between(0.05, 0.3) * size;
    let thick = draw.scale(1.0, 0.1 * size);
    let put = |rings: Vec<Corners>| -> Vec<Corners> {
        rings.iter().map(|r| moved(r, turn_rad, at)).collect()
    };
    match kind {
        "no zones" => Vec::new(),
        "blobs" => {
            let n = 1 + draw.below(6);
            let mut out = Vec::new();
            for _ in 0..n {
                let at = inside(draw, area);
                let corners = 3 + draw.below(6);
                let r = draw.scale(2.0, 0.2 * size);
                out.push(moved(&star(draw, corners, 0.3 * r, r), 0.0, at));
            }
            out
        }
        "pocket" => {
            // One zone like a horseshoe, its mouth closed but for a slit.
            let mouth = lane_m * draw.of(&[0.1, 0.9, 1.0, 1.1, 3.0]);
            let (r, t) = (room_m, thick);
            let m = (mouth / 2.0).min(0.9 * r);
            put(vec![corners(&[
                (-r - t, -r - t),
                (r + t, -r - t),
                (r + t, r + t),
                (m, r + t),
                (m, r),
                (r, r),
                (r, -r),
                (-r, -r),
                (-r, r),
                (-m, r),
                (-m, r + t),
                (-r - t, r + t),
            ])])
        }
        "ring" | "gapped ring" => {
            // Four walls whose ends overlap; one is shorter where there is a gap.
            let gap = match kind {
                "ring" => -thick / 2.0,
                _ => {
                    let c = manner.clearance_m;
                    draw.of(&[0.5 * c, 2.0 * c - 0.01, 2.0 * c + 0.01, 2.5 * c, lane_m])
                }
            };
            let (r, t) = (room_m, thick);
            put(vec![
                rectangle(-r - t, -r - t, 2.0 * (r + t), t),
                rectangle(-r - t, r, 2.0 * (r + t), t),
                rectangle(-r - t, -r - t, t, 2.0 * (r + t)),
                rectangle(r, -r - t / 2.0, t, 2.0 * r + t / 2.0 - gap),
            ])
        }
        "corridor" => {
            let wide = lane_m * draw.of(&[0.6, 0.99, 1.0, 1.01, 2.0]);
            let long = draw.between(0.2, 1.2) * size;
            put(vec![
                rectangle(-long / 2.0, wide / 2.0, long, thick),
                rectangle(-long / 2.0, -wide / 2.0 - thick, long, thick),
            ])
        }
        "border" => {
            let n = 1 + draw.below(4);
            let mut out = Vec::new();
            for _ in 0..n {
                let i = draw.below(area.len());
                let (a, b) = (area[i], area[(i + 1) % area.len()]);
                let share = draw.between(0.0, 1.0);
                let at = a.plus(b.minus(a), share);
                let corners = 4 + draw.below(4);
                let r = draw.scale(5.0, 0.25 * size);
                out.push(moved(&star(draw, corners, 0.4 * r, r), 0.0, at));
            }
            out
        }
        "needles" => {
            let n = 1 + draw.below(5);
            let mut out = Vec::new();
            for _ in 0..n {
                let at = inside(draw, area);
                let long = draw.between(0.1, 0.8) * size;
                let wide = draw.scale(0.05, 3.0);
                let needle = corners(&[
                    (-long / 2.0, 0.0),
                    (long / 2.0, -wide / 2.0),
                    (long / 2.0, wide / 2.0),
                ]);
                let turn = draw.between(0.0, TAU);
                out.push(moved(&needle, turn, at));
            }
            out
        }
        _ => {
            // Walls across the box from alternating sides.
            let (low, high) = bounds(area);
            let n = 2 + draw.below(3);
            let reach = draw.between(0.6, 0.98);
            let tall = (high.y - low.y) * reach + 10.0;
            #[allow(clippy::cast_precision_loss, reason = "a few walls")]
            let step = (high.x - low.x) / (n + 1) as f64;
            let mut out = Vec::new();
            let mut x = low.x;
            for i in 0..n {
                x += step;
                let y = if i % 2 == 0 {
                    low.y - 10.0
                } else {
                    high.y + 10.0 - tall
                };
                out.push(rectangle(x, y, thick.min(0.5 * step), tall));
            }
            out
        }
    }
}

/// Bits of a place.
fn draw_seed(at: Point) -> u64 {
    at.x.to_bits() ^ at.y.to_bits().rotate_left(17)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground_file::{self, Role};

    #[test]
    fn every_seed_is_a_site_of_simple_rings() {
        let mut kinds = std::collections::BTreeSet::new();
        for seed in 0..2000 {
            let site = Site::of(seed);
            let ground = site.ground().unwrap();
            assert_eq!(ground.areas.len(), 1);
            assert!(site.launch.norm() < 20_000.0, "{seed}");
            kinds.extend(site.kind.split(", ").map(str::to_owned));
            assert_eq!(site, Site::of(seed));
        }
        for kind in AREAS.iter().chain(&ZONES) {
            assert!(kinds.contains(*kind), "{kind}");
        }
        for kind in [
            "holes",
            "U fence",
            "tight fence",
            "wide fence",
            "cutting fence",
        ] {
            assert!(kinds.contains(kind), "{kind}");
        }
    }

    #[test]
    fn files_of_a_site_have_its_rings() {
        for seed in 0..200 {
            let site = Site::of(seed);
            let own = site.ground().unwrap();
            for (name, text) in [("s.geojson", site.geojson()), ("s.plan", site.plan())] {
                let file = ground_file::read(name, &text.to_string(), Role::Area).unwrap();
                let mut ground = Ground::default();
                file.add_to(&mut ground, PLANE).unwrap();
                let kept_out = own.zones.len() + own.holes.len();
                assert_eq!(ground.zones.len() + ground.holes.len(), kept_out, "{seed}");
                let (Outline::Ring(a), Outline::Ring(b)) =
                    (&ground.areas[0].outline, &own.areas[0].outline)
                else {
                    panic!("areas are rings");
                };
                assert!((a.area_m2() - b.area_m2()).abs() < 1e-3 * b.area_m2());
            }
        }
    }
}
