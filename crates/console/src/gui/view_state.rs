//! State that the window keeps between two pictures: selection, typed text and views. It holds no knowledge of the
//! world.

use wire::id::{TrackId, UnitId};
use wire::mode::Guard;
use wire::person::Order;
use wire::settings::Settings;

use super::alarm_block::AlarmView;
use super::layout::Pane;
use super::map::{Camera, Sides};
use super::sidecar::Textures;
use super::tracks::Sort;
use crate::shown::Shown;

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
    /// Search text for the history.
    pub(super) search: String,
    /// The alarms pane's own.
    pub(super) alarms: AlarmView,
    /// True if the evidence panel is shown.
    pub(super) sidecar: bool,
    /// Images of the track that the order rests on.
    pub(super) images: Textures,
    /// Order of the track table.
    pub(super) sort: Sort,
    /// The visible part of the map.
    pub(super) camera: Option<Camera>,
    /// Guard that has a plot of its own.
    pub(super) plotted: Option<Guard>,
    /// True if the whole run is plotted in place of the last minute.
    pub(super) whole_run: bool,
    /// Pane to turn to in this frame.
    pub(super) open: Option<Pane>,
    /// Images of the chosen track.
    pub(super) video: Textures,
    /// True if the map keeps the chosen unit in view.
    pub(super) follow: bool,
    /// Sides of the map's labels, so that these do not jump.
    pub(super) label_sides: Sides,
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
            alarms: AlarmView::default(),
            sidecar: true,
            images: Textures::default(),
            sort: Sort::default(),
            camera: None,
            plotted: None,
            whole_run: false,
            open: None,
            video: Textures::default(),
            follow: true,
            label_sides: Sides::new(),
        }
    }

    /// Selects another unit; the selection within the last one is dropped.
    pub(super) fn choose(&mut self, unit: UnitId) {
        if self.unit != unit {
            self.unit = unit;
            self.put_down();
            self.plotted = None;
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

    /// Records a picture's prepared order, for no order inherits another's reason.
    pub(super) fn note(&mut self, shown: &Shown) {
        let prepared = shown.prepared.map(|prepared| prepared.serial);
        if self.prepared != prepared {
            self.prepared = prepared;
            self.reason.clear();
        }
    }
}
