//! Placing labels: eight places at five distances around a symbol, with a leader from the second distance on.
//!
//! A label lies on no symbol and on no other label. It keeps off trails, routes, fences and passed objects too, unless
//! there is no other place. Where both lines find no room the second one goes, then the label, which is counted. A unit
//! must have its label: for it further distances are tried, then leaders across tracks, then places on tracks,
//! then the whole map. At equal
//! distance a label stays at the side where it was, so that it does not jump. Words are left to `words`, drawing to
//! `paint`.

use eframe::egui::{Pos2, Rect, Vec2, vec2};

/// Distances from the symbol, in its own reach.
const DISTANCES: [f32; 5] = [1.0, 2.2, 3.8, 6.0, 9.0];
/// Further distances for units.
const FURTHER: [f32; 4] = [12.5, 17.0, 23.0, 31.0];
/// Distance of places that are tried where none of these is free, points.
const ANYWHERE: Vec2 = vec2(12.0, 6.0);
/// Directions to the places, the best first.
const PLACES: [Vec2; 8] = [
    vec2(1.0, 0.0),
    vec2(-1.0, 0.0),
    vec2(0.0, -1.0),
    vec2(0.0, 1.0),
    vec2(0.8, -0.8),
    vec2(0.8, 0.8),
    vec2(-0.8, -0.8),
    vec2(-0.8, 0.8),
];
/// Room around a label, points.
const ROOM: Vec2 = vec2(3.0, 1.0);

/// A label that looks for a place.
#[derive(Clone, Debug)]
pub(super) struct Wanted {
    /// Middle of the symbol.
    pub(super) at: Pos2,
    /// Half of the symbol's side, points.
    pub(super) half: f32,
    /// Sizes of the lines, one or two.
    pub(super) sizes: Vec<Vec2>,
    /// Distances that are tried.
    pub(super) reach: Reach,
    /// Side at which it was last.
    pub(super) last: Option<Side>,
}

/// One of the eight sides of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::gui) struct Side(usize);

/// Distances from the symbol at which a label looks for a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// The first alone: without a leader.
    Beside,
    /// All five.
    Usual,
    /// Further ones too, rather than no label.
    Further,
}

/// Things that a label or its leader may lie on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Over {
    /// None.
    Nothing,
    /// A trail, a route, the fence, a passed object.
    Lines,
    /// These, and a leader may cross symbols and other leaders.
    Crossing,
    /// These, and a label may lie on tracks.
    Tracks,
    /// These, and a leader may cross labels.
    Labels,
}

/// The place of a label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placed {
    /// The label's lines.
    pub(super) rect: Rect,
    /// Number of lines that have room.
    pub(super) lines: usize,
    /// Side of the symbol.
    pub(super) side: Side,
    /// Ends of the line to the symbol, of a label that is not beside it.
    pub(super) leader: Option<[Pos2; 2]>,
}

/// Everything that labels keep off.
#[derive(Clone, Debug)]
pub(super) struct Obstacles {
    /// The area that a label keeps within.
    pub(super) area: Rect,
    /// Labels, which no label ever lies on.
    pub(super) solid: Vec<Rect>,
    /// Symbols of units, which no label ever lies on.
    pub(super) units: Vec<Rect>,
    /// Symbols of tracks, which only the label of a unit may lie on.
    pub(super) tracks: Vec<Rect>,
    /// Trails, routes, fences and passed objects, which a label lies on where there is no other place.
    pub(super) lines: Vec<[Pos2; 2]>,
    /// Leaders, which labels and other leaders cross only where a unit finds no other place.
    pub(super) leaders: Vec<[Pos2; 2]>,
}

impl Obstacles {
    /// Adds the line through these points.
    pub(super) fn add_path(&mut self, points: &[Pos2]) {
        let area = self.area;
        let ends = points.windows(2).map(|pair| [pair[0], pair[1]]);
        self.lines.extend(ends.filter(|ends| crosses(*ends, area)));
    }

    /// Finds a place and takes it; none if there is no room.
    pub(super) fn place(&mut self, wanted: &Wanted) -> Option<Placed> {
        const LAST: &[Over] = &[Over::Crossing, Over::Tracks, Over::Labels];
        const USUAL: &[Over] = &[Over::Nothing, Over::Lines];
        let ways: &[(&[f32], &[Over])] = match wanted.reach {
            Reach::Beside => &[(&DISTANCES[..1], USUAL)],
            Reach::Usual => &[(&DISTANCES, USUAL)],
            Reach::Further => &[(&DISTANCES, USUAL), (&FURTHER, USUAL), (&DISTANCES, LAST), (&FURTHER, LAST)],
        };
        let all = wanted.sizes.len();
        let mut tried = ways.iter().flat_map(|(distances, overs)| overs.iter().map(|over| (*distances, *over)));
        let found = tried.find_map(|(distances, over)| {
            [all, 1].into_iter().find_map(|lines| self.search(wanted, lines, distances, over))
        });
        let must = wanted.reach == Reach::Further;
        let found = found.or_else(|| must.then(|| self.anywhere(wanted)).flatten())?;
        self.solid.push(found.rect.expand2(ROOM));
        self.leaders.extend(found.leader);
        Some(found)
    }

    /// The nearest free place of the whole area for the first line.
    fn anywhere(&self, wanted: &Wanted) -> Option<Placed> {
        let size = extent(&wanted.sizes[..1]);
        let [across, down] = [self.area.width() / ANYWHERE.x, self.area.height() / ANYWHERE.y].map(|n| n as usize);
        let corners = (0..=down).flat_map(|y| (0..=across).map(move |x| vec2(x as f32, y as f32)));
        let offsets = corners.map(|corner| self.area.min + corner * ANYWHERE - wanted.at);
        let far = |offset: &Vec2| (*offset + size / 2.0).length();
        let mut offsets: Vec<Vec2> = offsets.collect();
        offsets.sort_by(|a, b| far(a).total_cmp(&far(b)));
        offsets.into_iter().find_map(|offset| {
            let rect = Rect::from_min_size(wanted.at + offset, size);
            let (rect, leader) = self.fits(wanted, rect, true, Over::Labels)?;
            Some(Placed { rect, lines: 1, side: wanted.last.unwrap_or(Side(0)), leader })
        })
    }

    /// The nearest free place of so many lines; of equally near ones that at the last side.
    fn search(&self, wanted: &Wanted, lines: usize, distances: &[f32], over: Over) -> Option<Placed> {
        let size = extent(&wanted.sizes[..lines]);
        let reach = wanted.half * 1.25 + 1.0;
        let sides = || wanted.last.into_iter().chain((0..PLACES.len()).map(Side));
        let mut places = distances.iter().flat_map(|far| sides().map(move |side| (*far, side)));
        places.find_map(|(far, side)| {
            let offset = PLACES[side.0] * reach * far;
            let (rect, leader) = self.fits(wanted, beside(wanted.at, offset, size), far > 1.0, over)?;
            Some(Placed { rect, lines, side, leader })
        })
    }

    /// The label with its leader, if it is free there.
    fn fits(&self, wanted: &Wanted, rect: Rect, far: bool, over: Over) -> Option<(Rect, Option<[Pos2; 2]>)> {
        let taken = rect.expand2(ROOM);
        let free = self.area.contains_rect(taken)
            && !self.solid.iter().chain(&self.units).any(|solid| solid.intersects(taken))
            && (over >= Over::Crossing || !self.leaders.iter().any(|line| crosses(*line, taken)))
            && (over >= Over::Tracks || !self.tracks.iter().any(|track| track.intersects(taken)))
            && (over >= Over::Lines || !self.lines.iter().any(|line| crosses(*line, taken)));
        if !free {
            return None;
        }
        let leader = far.then(|| leader(wanted, rect));
        let crossed =
            |symbol: &&Rect| !symbol.contains(wanted.at) && leader.is_some_and(|line| crosses(line, **symbol));
        let tangled = |other: &&[Pos2; 2]| leader.is_some_and(|line| meet(line, **other));
        let symbols = self.tracks.iter().chain(&self.units).filter(|_| over < Over::Crossing);
        let mut leaders = self.leaders.iter().filter(|_| over < Over::Crossing);
        let free = !self.solid.iter().filter(|_| over < Over::Labels).chain(symbols).any(|symbol| crossed(&symbol))
            && !leaders.any(|other| tangled(&other));
        free.then_some((rect, leader))
    }
}

/// A label of this size, with the corner or side towards `at` at this offset.
fn beside(at: Pos2, offset: Vec2, size: Vec2) -> Rect {
    let share = |along: f32| match along {
        along if along > 0.1 => 0.0,
        along if along < -0.1 => 1.0,
        _ => 0.5,
    };
    Rect::from_min_size(at + offset - vec2(share(offset.x), share(offset.y)) * size, size)
}

/// The line from a symbol's edge to the nearest side of its label.
fn leader(wanted: &Wanted, rect: Rect) -> [Pos2; 2] {
    let end = wanted.at.clamp(rect.min - ROOM, rect.max + ROOM);
    let to = (end - wanted.at).normalized();
    [wanted.at + to * wanted.half, end]
}

fn extent(sizes: &[Vec2]) -> Vec2 {
    sizes.iter().fold(Vec2::ZERO, |all, size| vec2(all.x.max(size.x), all.y + size.y))
}

/// True if a part of the line lies in the rectangle.
fn crosses([from, to]: [Pos2; 2], rect: Rect) -> bool {
    let (mut first, mut last) = (0.0_f32, 1.0_f32);
    for (start, along, low, high) in
        [(from.x, to.x - from.x, rect.min.x, rect.max.x), (from.y, to.y - from.y, rect.min.y, rect.max.y)]
    {
        if along == 0.0 {
            if start < low || start > high {
                return false;
            }
            continue;
        }
        let (one, two) = ((low - start) / along, (high - start) / along);
        (first, last) = (first.max(one.min(two)), last.min(one.max(two)));
    }
    first <= last
}

/// True if two lines cross.
fn meet([a, b]: [Pos2; 2], [c, d]: [Pos2; 2]) -> bool {
    let side = |from: Pos2, to: Pos2, of: Pos2| (to - from).rot90().dot(of - from) > 0.0;
    side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn obstacles() -> Obstacles {
        let area = Rect::from_min_size(Pos2::ZERO, vec2(560.0, 420.0));
        Obstacles {
            area,
            solid: Vec::new(),
            units: Vec::new(),
            tracks: Vec::new(),
            lines: Vec::new(),
            leaders: Vec::new(),
        }
    }

    fn wanted(x: f32, y: f32, lines: usize) -> Wanted {
        Wanted {
            at: Pos2::new(x, y),
            half: 10.0,
            sizes: vec![vec2(80.0, 18.0); lines],
            reach: Reach::Usual,
            last: None,
        }
    }

    /// Symbols in a spiral, as many as a crowd has.
    fn crowd(of: usize) -> Vec<Wanted> {
        let spiral = (0..of).map(|n| {
            let (sin, cos) = libm::sincosf(n as f32 * 2.4);
            let far = 14.0 * libm::sqrtf(n as f32);
            wanted(280.0 + far * cos, 210.0 + far * sin, 2)
        });
        spiral.collect()
    }

    #[test]
    fn no_label_lies_on_another_or_on_a_symbol() {
        for of in [1, 8, 40, 200] {
            let mut obstacles = obstacles();
            let all = crowd(of);
            obstacles.solid.extend(all.iter().map(|one| Rect::from_center_size(one.at, Vec2::splat(20.0))));
            let placed: Vec<Placed> = all.iter().filter_map(|one| obstacles.place(one)).collect();
            assert!(placed.len() >= of.min(6), "{of}: {}", placed.len());
            for (at, one) in placed.iter().enumerate() {
                assert!(obstacles.area.contains_rect(one.rect));
                assert!(placed[..at].iter().all(|other| !other.rect.intersects(one.rect)), "{of}: {one:?}");
                assert!(obstacles.solid[..of].iter().all(|symbol| !symbol.intersects(one.rect)), "{of}: {one:?}");
                let crossed = |line| placed[..at].iter().any(|other| crosses(line, other.rect.shrink(1.0)));
                assert!(!one.leader.is_some_and(crossed), "{of}: a leader runs over a label");
                let others = || placed[..at].iter().filter_map(|other| other.leader);
                assert!(!one.leader.is_some_and(|line| others().any(|other| meet(line, other))), "{of}: leaders cross");
            }
        }
    }

    #[test]
    fn a_label_gives_up_its_second_line_then_its_distance_to_lines() {
        let mut free = obstacles();
        let beside = free.place(&wanted(280.0, 210.0, 2)).unwrap();
        assert_eq!((beside.lines, beside.leader), (2, None));
        let mut low = obstacles();
        low.area = Rect::from_center_size(Pos2::new(280.0, 210.0), vec2(300.0, 24.0));
        assert_eq!(low.place(&wanted(280.0, 210.0, 2)).map(|placed| placed.lines), Some(1));
        let mut lined = low.clone();
        lined.solid.clear();
        lined.lines.push([Pos2::new(0.0, 210.0), Pos2::new(560.0, 210.0)]);
        assert!(lined.place(&wanted(280.0, 210.0, 2)).is_some(), "there is no other place than on the line");
        let mut none = obstacles();
        none.solid.push(none.area);
        assert_eq!(none.place(&wanted(280.0, 210.0, 2)), None);
    }

    #[test]
    fn a_label_keeps_off_lines_and_gets_a_leader() {
        let mut obstacles = obstacles();
        for side in [-34.0, 0.0, 34.0] {
            obstacles.add_path(&[Pos2::new(0.0, 210.0 + side), Pos2::new(560.0, 210.0 + side)]);
        }
        let placed = obstacles.place(&wanted(280.0, 210.0, 2)).unwrap();
        assert!(placed.leader.is_some() && placed.lines == 2, "{placed:?}");
        assert!(obstacles.lines[..3].iter().all(|line| !crosses(*line, placed.rect)));
    }

    #[test]
    fn a_label_stays_at_its_side_unless_a_nearer_place_is_free() {
        let below = obstacles().place(&Wanted { last: Some(Side(3)), ..wanted(280.0, 210.0, 2) }).unwrap();
        assert!(below.side == Side(3) && below.leader.is_none() && below.rect.top() > 210.0, "{below:?}");
        let mut taken = obstacles();
        taken.solid.push(Rect::from_center_size(Pos2::new(280.0, 240.0), vec2(60.0, 30.0)));
        let moved = taken.place(&Wanted { last: Some(Side(3)), ..wanted(280.0, 210.0, 2) }).unwrap();
        assert!(moved.side != Side(3) && moved.leader.is_none(), "beside it there is room: {moved:?}");
    }

    #[test]
    fn what_must_have_a_label_finds_one_further_away() {
        let mut obstacles = obstacles();
        obstacles.solid.push(Rect::from_center_size(Pos2::new(280.0, 210.0), vec2(300.0, 300.0)));
        let one = wanted(280.0, 210.0, 2);
        assert_eq!(obstacles.place(&one), None);
        assert_eq!(obstacles.place(&Wanted { reach: Reach::Beside, ..one.clone() }), None);
        let must = Wanted { reach: Reach::Further, ..one };
        assert!(obstacles.place(&must).is_some());
        obstacles.solid.clear();
        obstacles.tracks.push(obstacles.area);
        assert!(obstacles.place(&must).is_some(), "on tracks, where these are everywhere");
        obstacles.solid.push(obstacles.area);
        assert_eq!(obstacles.place(&must), None, "never on another label");
    }
}
