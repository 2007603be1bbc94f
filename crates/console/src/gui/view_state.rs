//! State that the window keeps between two pictures: selection, typed text and views. It holds no knowledge of the
//! world but the plotted ages, which are of pictures that were drawn.

use std::collections::{BTreeMap, VecDeque};

use wire::id::{TrackId, UnitId};
use wire::person::Order;
use wire::settings::Settings;
use wire::time::{Instant, Span};

use super::map::{Camera, Sides};
use super::sidecar::Textures;
use super::tracks::Sort;
use crate::shown::Shown;

/// Length of the plot of a unit's ages.
pub(super) const PLOTTED: Span = Span::s(60);
/// Time between two plotted ages; so at most 600 of each unit are kept.
const BETWEEN_AGES: Span = Span::ms(100);

/// The window's own state.
#[derive(Debug)]
pub(super) struct ViewState {
    /// Unit that commands go to.
    pub(super) unit: UnitId,
    /// Track that is selected.
    pub(super) track: Option<(UnitId, TrackId)>,
    /// Order away from safe, with its conditions displayed.
    pub(super) order: Option<Order>,
    /// True if the menu of revocable identities is open.
    pub(super) revoking: bool,
    /// The values of an order to configure, once edited.
    pub(super) values: Option<Settings>,
    /// The typed reason for the prepared order.
    pub(super) reason: String,
    /// Number of the act that prepared the order.
    prepared: Option<u64>,
    /// Search text for alarms and history.
    pub(super) search: String,
    /// True if the history is shown in place of alarms.
    pub(super) past: bool,
    /// True if alarms that were acknowledged are shown.
    pub(super) acknowledged: bool,
    /// True if the evidence panel is shown.
    pub(super) sidecar: bool,
    /// Images of the track that the order rests on.
    pub(super) images: Textures,
    /// Order of the track table.
    pub(super) sort: Sort,
    /// The visible part of the map.
    pub(super) camera: Option<Camera>,
    /// True if the map keeps the chosen unit in view.
    pub(super) follow: bool,
    /// Sides of the map's labels, so that these do not jump.
    pub(super) label_sides: Sides,
    /// Ages of shown reports, by unit, oldest first.
    pub(super) ages: BTreeMap<UnitId, VecDeque<(Instant, Span)>>,
}

impl ViewState {
    pub(super) fn new(unit: UnitId) -> Self {
        Self {
            unit,
            track: None,
            order: None,
            revoking: false,
            values: None,
            reason: String::new(),
            prepared: None,
            search: String::new(),
            past: false,
            acknowledged: true,
            sidecar: true,
            images: Textures::default(),
            sort: Sort::default(),
            camera: None,
            follow: true,
            label_sides: Sides::new(),
            ages: BTreeMap::new(),
        }
    }

    /// Selects another unit; the selection within the last one is dropped.
    pub(super) fn choose(&mut self, unit: UnitId) {
        if self.unit != unit {
            self.unit = unit;
            self.put_down();
            self.track = self.track.filter(|(owner, _)| *owner == unit);
        }
    }

    /// The values of an order to configure the chosen unit: as edited, else those in force.
    pub(super) fn settings(&self, shown: &Shown) -> Settings {
        self.values.unwrap_or_else(|| self.in_force(shown))
    }

    /// The values in force at the chosen unit, or the platform's own.
    pub(super) fn in_force(&self, shown: &Shown) -> Settings {
        let unit = shown.unit(self.unit);
        unit.map_or(Settings::from_bounds(&shown.bounds), |unit| unit.settings(&shown.bounds))
    }

    /// Clears the chosen order: it is dropped, or under way.
    pub(super) fn put_down(&mut self) {
        (self.order, self.values, self.revoking) = (None, None, false);
        self.reason.clear();
    }

    /// Looks at a track, and turns to its unit.
    pub(super) fn look_at(&mut self, unit: UnitId, track: TrackId) {
        self.choose(unit);
        self.track = Some((unit, track));
    }

    /// Records the ages of a picture and its prepared order, for no order inherits another's reason. In a recording
    /// time also runs backwards: then the plot begins again.
    pub(super) fn note(&mut self, shown: &Shown) {
        let prepared = shown.prepared.map(|prepared| prepared.serial);
        if self.prepared != prepared {
            self.prepared = prepared;
            self.reason.clear();
        }
        for unit in &shown.units {
            let ages = self.ages.entry(unit.unit).or_default();
            match ages.back() {
                Some((last, _)) if shown.at < *last => ages.clear(),
                Some((last, _)) if shown.at.since(*last) < BETWEEN_AGES => continue,
                _ => {}
            }
            ages.push_back((shown.at, unit.state.age()));
            while ages.front().is_some_and(|(first, _)| shown.at.since(*first) > PLOTTED) {
                ages.pop_front();
            }
        }
    }
}
