//! Footprints of things on the ground: distances, corners, and whether two meet.
//!
//! Metres, east and north; headings in radians, anticlockwise from east.

/// East, north.
pub(crate) type At = [f64; 2];

/// A box on the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    pub(crate) at: At,
    pub(crate) heading: f64,
    /// Length along the heading, and width.
    pub(crate) size: [f64; 2],
}

impl Footprint {
    /// Distance of a place from the box; zero inside.
    pub(crate) fn distance(&self, to: At) -> f64 {
        self.distances()(to)
    }

    /// Distances from many places.
    pub(crate) fn distances(&self) -> impl Fn(At) -> f64 {
        let (sin, cos) = libm::sincos(self.heading);
        let Self { at, size, .. } = *self;
        move |to| {
            let (east, north) = (to[0] - at[0], to[1] - at[1]);
            let ahead = ((east * cos + north * sin).abs() - size[0] / 2.0).max(0.0);
            let aside = ((north * cos - east * sin).abs() - size[1] / 2.0).max(0.0);
            (ahead * ahead + aside * aside).sqrt()
        }
    }

    pub(crate) fn corners(&self) -> [At; 4] {
        let (sin, cos) = libm::sincos(self.heading);
        [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)].map(|(a, b)| {
            let (along, aside) = (a * self.size[0] / 2.0, b * self.size[1] / 2.0);
            [self.at[0] + along * cos - aside * sin, self.at[1] + along * sin + aside * cos]
        })
    }

    /// True if less than `gap` separates the boxes along every direction of their sides.
    pub(crate) fn meets(&self, other: &Footprint, gap: f64) -> bool {
        let is_separated = |axis: f64| {
            let (sin, cos) = libm::sincos(axis);
            let span = |footprint: &Footprint| {
                let along = footprint.corners().map(|[east, north]| east * cos + north * sin);
                (along.iter().copied().fold(f64::MAX, f64::min), along.iter().copied().fold(f64::MIN, f64::max))
            };
            let ((a, b), (c, d)) = (span(self), span(other));
            c - b >= gap || a - d >= gap
        };
        let quarter = core::f64::consts::FRAC_PI_2;
        ![self.heading, self.heading + quarter, other.heading, other.heading + quarter].into_iter().any(is_separated)
    }
}
