//! The track table: the tracks that each unit reports with age and origin; and those it no longer reports.

use std::cmp::Ordering;

use config::suite::Suite;
use eframe::egui::{Align, Button, Color32, Label, Layout, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo};
use egui_extras::{Column, TableBuilder, TableRow};
use wire::event::Freshness;
use wire::id::{TrackId, UnitId};
use wire::report::ReportedTrack;
use wire::sensor::Modality;

use super::keys;
use super::marks::{self, Shape, Tone};
use super::theme::{Palette, ROW};
use super::view_state::ViewState;
use super::words::{at_most, metres, origin, seconds};
use super::{Wish, command, map};
use crate::act::{Act, Alarm};
use crate::age::Labelled;
use crate::shown::{Shown, ShownUnit};
use crate::text;

/// Sort key of the table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Sort {
    /// Unit, then number.
    #[default]
    Number,
    /// Youngest first.
    Age,
    /// Surest first.
    Confidence,
}

/// A row of the table.
struct Row<'s> {
    unit: &'s ShownUnit,
    track: &'s Labelled<ReportedTrack>,
    /// Acknowledgement of the loss.
    lost: Option<Act>,
}

impl Row<'_> {
    fn id(&self) -> (UnitId, TrackId) {
        (self.unit.unit, self.track.get().0.id)
    }

    fn compare(&self, other: &Self, sort: Sort) -> Ordering {
        let confidence = |row: &Self| std::cmp::Reverse(row.track.get().0.confidence);
        match sort {
            Sort::Number => self.id().cmp(&other.id()),
            Sort::Age => (self.track.age(), self.id()).cmp(&(other.track.age(), other.id())),
            Sort::Confidence => (confidence(self), self.id()).cmp(&(confidence(other), other.id())),
        }
    }
}

/// A column.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Track,
    Class,
    Age,
    Confidence,
    Away,
    Sensors,
}

/// The columns: head, sort key, width, and the width of a pane from which on it stands there, points.
const COLUMNS: [(Part, &str, Option<Sort>, f32, f32); 6] = [
    (Part::Track, "track", Some(Sort::Number), 48.0, 0.0),
    (Part::Class, "class", None, 74.0, 320.0),
    (Part::Age, "age", Some(Sort::Age), 122.0, 0.0),
    (Part::Confidence, "confidence", Some(Sort::Confidence), 88.0, 414.0),
    (Part::Away, "away", None, 50.0, 470.0),
    (Part::Sensors, "sensors", None, 58.0, 240.0),
];

/// The table. A narrow pane leaves the columns out that matter least, and scrolls sideways where the rest does not fit. A click on a row looks at its track.
pub(super) fn draw(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    for unit in shown.units.iter().filter(|unit| unit.lost_more > 0) {
        let text = format!("{}: {} more LOST, for which there was no room", unit.unit, unit.lost_more);
        ui.label(RichText::new(text).color(Tone::Advice.color(Palette::current(ui))));
    }
    ScrollArea::horizontal().auto_shrink([false, false]).show(ui, |ui| table(ui, view_state, shown, wishes));
}

fn table(ui: &mut Ui, view_state: &mut ViewState, shown: &Shown, wishes: &mut Vec<Wish>) {
    let width = ui.available_width() - ui.spacing().scroll.allocated_width();
    let rows = rows(shown, view_state.sort);
    if rows.is_empty() {
        ui.weak("No unit reports a track.");
        return;
    }
    // Rows out of sight hold no control that Tab could lead to.
    keys::scroll_next(ui, "list of tracks");
    // The pointer takes the whole row; the keyboard stops once in it, at its name.
    let mut table = TableBuilder::new(ui).striped(true).sense(Sense::CLICK).auto_shrink([false, false]);
    table = table.cell_layout(Layout::left_to_right(Align::Center));
    let columns: Vec<_> = COLUMNS.into_iter().filter(|(.., from)| width >= *from).collect();
    for (part, _, _, width, _) in &columns {
        let exact = *part != Part::Sensors;
        let column = if exact { Column::exact(*width) } else { Column::remainder().at_least(*width) };
        table = table.column(column.clip(true));
    }
    let table = table.header(ROW, |mut header| {
        for (_, name, sort, ..) in &columns {
            header.col(|ui| head(ui, view_state, name, *sort));
        }
    });
    table.body(|body| {
        body.rows(ROW, rows.len(), |mut row| {
            let Some(row_of) = rows.get(row.index()) else { return };
            row.set_selected(view_state.track == Some(row_of.id()));
            let mut chosen = false;
            for (part, ..) in &columns {
                chosen |= cell(&mut row, *part, row_of, shown, wishes);
            }
            let response = row.response();
            let (unit, track) = row_of.id();
            let (_, _, word) = word_of(row_of);
            let (_, origin) = origin(row_of.unit.origin);
            let age = seconds(row_of.track.age());
            let text = format!("TRACK {unit} {} {} {word} {age}, origin {origin}", track.0, class(row_of));
            response.widget_info(|| WidgetInfo::labeled(Role::Row, true, &text));
            if chosen || response.clicked() {
                view_state.look_at(unit, track);
            }
        });
    });
}

fn rows(shown: &Shown, sort: Sort) -> Vec<Row<'_>> {
    let mut rows = Vec::new();
    for unit in &shown.units {
        rows.extend(unit.tracks.iter().map(|track| Row { unit, track, lost: None }));
        rows.extend(unit.lost.iter().map(|lost| {
            let alarm = Alarm::TrackLost(unit.unit, lost.boot, lost.track.get().0.id);
            Row { unit, track: &lost.track, lost: Some(Act::Acknowledge(alarm, lost.since)) }
        }));
    }
    rows.sort_by(|a, b| a.compare(b, sort));
    rows
}

fn head(ui: &mut Ui, view_state: &mut ViewState, name: &str, sort: Option<Sort>) {
    let Some(sorting) = sort else {
        ui.add(Label::new(RichText::new(name).weak()).truncate());
        return;
    };
    let text = RichText::new(name).weak();
    let text = if view_state.sort == sorting { text.underline() } else { text };
    let button = ui.add(Button::new(text).frame(false).min_size([0.0, 0.0].into()));
    button.widget_info(|| {
        WidgetInfo::selected(Role::Button, true, view_state.sort == sorting, format!("order by {name}"))
    });
    if button.clicked() {
        view_state.sort = sorting;
    }
}

fn word_of(row: &Row<'_>) -> (Tone, Shape, &'static str) {
    marks::track(row.track.freshness(), row.lost.is_some())
}

fn class(row: &Row<'_>) -> &'static str {
    row.track.get().0.class.name()
}

/// Draws a cell of a row. True if the track's name was pressed.
fn cell(row: &mut TableRow<'_, '_>, part: Part, of: &Row<'_>, shown: &Shown, wishes: &mut Vec<Wish>) -> bool {
    let track = of.track.get().0;
    let mut chosen = false;
    row.col(|ui| {
        let palette = Palette::current(ui);
        let ink = if of.lost.is_some() { palette.weak } else { palette.text };
        let write = |ui: &mut Ui, text: String, color| ui.add(Label::new(RichText::new(text).color(color)).truncate());
        match part {
            Part::Track => chosen = name(ui, of, ink),
            Part::Class => drop(write(ui, class(of).to_owned(), ink)),
            Part::Age => age(ui, of, shown, ink, wishes),
            Part::Confidence => {
                let unsure = map::unsure(of.unit, track, shown);
                let confidence = format!("{:.2}", f64::from(track.confidence) / 1000.0);
                write(ui, confidence, if unsure { palette.weak } else { ink });
            }
            Part::Away => {
                let pose = of.unit.pose.get().0;
                let [east, north] = [metres(track.x_mm) - metres(pose.x_mm), metres(track.y_mm) - metres(pose.y_mm)];
                write(ui, format!("{:.0} m", libm::hypot(east, north)), ink);
            }
            Part::Sensors => {
                let (letters, names) = sensors(of.unit.state.get().0.suite(), track);
                let place = format!("{names}; {:.1} m east, {:.1} m north", metres(track.x_mm), metres(track.y_mm));
                ui.label(RichText::new(letters).monospace().color(ink)).on_hover_text(place);
            }
        }
    });
    chosen
}

/// The track's name, a control: true if it was pressed.
fn name(ui: &mut Ui, of: &Row<'_>, ink: Color32) -> bool {
    let (unit, track) = of.id();
    let short = format!("{} {}", unit.name().trim_start_matches("unit-"), track.0);
    let button = ui.add(Button::new(RichText::new(short).color(ink)).frame(false).min_size([0.0, 0.0].into()));
    let line = format!("choose track {unit} {}", track.0);
    button.widget_info(|| WidgetInfo::labeled(Role::Button, true, &line));
    button.clicked()
}

/// The age with its sign; of a lost track the button that acknowledges it.
fn age(ui: &mut Ui, of: &Row<'_>, shown: &Shown, ink: Color32, wishes: &mut Vec<Wish>) {
    let palette = Palette::current(ui);
    let (tone, shape, word) = word_of(of);
    marks::shape(ui, shape, tone, word);
    let Some(act) = of.lost else {
        let color = if tone > Tone::Normal { tone.color(palette) } else { ink };
        let age = at_most(of.track.age());
        let words = if of.track.freshness() == Freshness::Fresh { age } else { format!("{word} {age}") };
        ui.add(Label::new(RichText::new(words).color(color)).truncate());
        return;
    };
    let dead = command::dead(shown);
    let (unit, track) = of.id();
    let line = format!("acknowledge that track {unit} {} is lost", track.0);
    let age = format!("lost {}", seconds(of.track.age()));
    let button = Button::new(RichText::new(age).small().color(palette.weak)).small();
    let button = command::able(ui, dead, button).on_hover_text(&line);
    let enabled = dead.is_none() && ui.is_enabled();
    button.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, &line));
    if button.clicked() {
        wishes.push(Wish::Act(act));
    }
}

/// The modalities that support a track or, as small letters, contradict it, each in its place, and their names.
fn sensors(suite: Suite, track: &ReportedTrack) -> (String, String) {
    let letter = |m: &Modality| suite.letter(*m);
    let mark = |m: &Modality| match (track.contradicted.contains(*m), track.supported.contains(*m)) {
        (true, _) => letter(m).to_ascii_lowercase(),
        (false, true) => letter(m),
        (false, false) => '-',
    };
    let listed = |modalities| text::names(suite, modalities).collect::<Vec<_>>().join(", ");
    let supported = if track.supported.count() == 0 { "no sensor".to_owned() } else { listed(track.supported) };
    let line = if track.contradicted.count() == 0 {
        String::new()
    } else {
        format!("; against it: {}", listed(track.contradicted))
    };
    (Modality::ALL.iter().map(mark).collect(), supported + &line)
}
