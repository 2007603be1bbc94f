//! The console's window: draws [`Shown`] and returns a person's wishes. All of egui is in here, and only egui.
//!
//! [`ConsoleWindow::draw`] is a function of the picture and of the window's own state (`view_state`, `layout`); it
//! reads no clock, counts no age and makes no decision. Panels that must always be seen stand fixed around the panes: the
//! `context` bar, the `banner`, the `units`, the `command` column. Getting pictures and sending acts is left to
//! [`app`].

pub mod app;
pub mod layout;
pub mod replay;
pub mod sensors;
pub mod theme;

mod alarm_block;
mod alarms;
mod banner;
mod bell;
mod command;
mod compare;
mod context;
mod flight;
mod given;
mod images;
mod keys;
mod map;
mod marks;
mod plots;
mod refusals;
mod series;
mod settings;
mod sidecar;
mod tracks;
mod units;
mod video;
mod view_state;
mod why;
mod words;

use eframe::egui::{
    Button, CentralPanel, Frame, Margin, Panel, Rect, RichText, Role, ScrollArea, Stroke, TextEdit, Theme, Ui,
    UiBuilder, WidgetInfo,
};
use wire::id::UnitId;
use wire::time::Span;

use self::compare::Half;
use self::layout::{Layouts, MAX_NAME, Pane, Panes, Preset};
use self::sidecar::Textures;
use self::theme::Palette;
use self::view_state::ViewState;
use crate::act::Act;
use crate::shown::Shown;
use crate::sidecar::Sidecar;
use crate::site::Site;
use crate::source::{Beside, Seek, Tape};

/// Opacity of a picture that is not current: low enough to be distinguished at once from a current one.
const PAST: f32 = 0.65;
/// The longest shown reason of an INVALID recording, characters: two lines in the narrowest window.
const MAX_WHY: usize = 240;
/// Width of a window from which on the units have a column of their own, and the width of that, points.
const CARDS: f32 = 1680.0;
const UNITS: f32 = 300.0;
/// Height that is kept for the guards below the units.
const REASONS: f32 = 420.0;

/// A request of the person at the window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wish {
    /// To do something.
    Act(Act),
    /// To go elsewhere in a recording.
    Seek(Seek),
}

/// Input of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'p> {
    /// The newest picture.
    pub shown: &'p Shown,
    /// Time since the last picture, once that is too long to call it current.
    pub behind: Option<Span>,
    /// An act was just refused by the source.
    pub untaken: bool,
    /// Position of the recording, if it is one.
    pub tape: Option<&'p Tape>,
    /// The recording's evidence of that moment.
    pub sidecar: Option<&'p Sidecar>,
    /// Another recording at the same time of its run.
    pub beside: Option<&'p Beside>,
}

/// The window's content.
#[derive(Debug)]
pub struct ConsoleWindow {
    view_state: ViewState,
    site: Site,
    layouts: Layouts,
    /// The typed name for a layout.
    name: String,
    /// View of the recording beside this one.
    half: Half,
    /// True once the panes were arranged for the window's width.
    arranged: bool,
    textures: Textures,
}

impl ConsoleWindow {
    /// A window over `site` that commands `unit` first.
    pub fn new(unit: UnitId, site: Site) -> Self {
        Self {
            view_state: ViewState::new(unit),
            site: site.sound(),
            layouts: Layouts::default(),
            name: String::new(),
            half: Half::new(unit),
            arranged: false,
            textures: Textures::default(),
        }
    }

    /// The layouts, for saving and for changes.
    pub fn layouts_mut(&mut self) -> &mut Layouts {
        &mut self.layouts
    }

    /// Says whether alarms can be heard here: the alarms pane tells it.
    pub fn set_bell(&mut self, rings: bool) {
        self.view_state.alarms.bell = rings;
    }

    /// Draws a notice that no picture has come yet; returns the person's requests.
    pub fn wait(&mut self, ui: &mut Ui) -> Vec<Wish> {
        let text = format!("Waiting for the console's core. F1 holds {}.", self.view_state.unit);
        CentralPanel::default().show(ui, |ui| ui.label(RichText::new(text).size(15.0)));
        command::keys_unseen(ui, self.view_state.unit)
    }

    /// Draws one frame; returns the person's requests.
    pub fn draw(&mut self, ui: &mut Ui, picture: &Picture<'_>) -> Vec<Wish> {
        let mut wishes = Vec::new();
        let shown = picture.shown;
        self.view_state.note(shown);
        command::no_repeats(ui);
        command::keys(ui, &mut self.view_state, shown, &mut wishes);
        alarms::keys(ui, shown, &mut wishes);
        let palette = Palette::current(ui);
        let frame = |x: i8, y: i8| Frame::new().fill(palette.pane).inner_margin(Margin::symmetric(x, y));
        let window = ui.ctx().content_rect().width();
        Panel::top("context")
            .resizable(false)
            .frame(Frame::new().fill(palette.ground).inner_margin(Margin::symmetric(8, 5)))
            .show(ui, |ui| context::draw(ui, shown));
        if let Some(beside) = picture.beside {
            if let Some(tape) = picture.tape {
                let bar = Panel::bottom("replay").resizable(false).frame(frame(8, 4));
                bar.show(ui, |ui| replay::draw(ui, tape, None, &mut wishes));
            }
            let (view_state, half) = (&mut self.view_state, &mut self.half);
            let ground = CentralPanel::default().frame(Frame::new().fill(palette.ground));
            ground.show(ui, |ui| compare::draw(ui, (view_state, &self.site, shown), half, beside));
            return wishes;
        }
        // The answers come first to those who hear the screen, then the orders, then the rest.
        let whole = ui.available_rect_before_wrap();
        let (rest, rail) = whole.split_left_right_at_x(whole.right() - command::width(window));
        let part = |place: Rect, name: &str| UiBuilder::new().max_rect(place).id_salt(name);
        let under = ui.scope_builder(part(rest, "answers"), |ui| self.answers(ui, picture)).inner;
        ui.scope_builder(part(rail, "rail"), |ui| self.rail(ui, shown, &mut wishes));
        ui.scope_builder(part(rest.with_min_y(under), "rest"), |ui| self.rest(ui, picture, &mut wishes));
        wishes
    }

    /// Banner and, where they have no column, units. Returns where they end.
    fn answers(&mut self, ui: &mut Ui, picture: &Picture<'_>) -> f32 {
        let frame = Frame::new().fill(Palette::current(ui).pane).inner_margin(Margin::same(8));
        let panel = Panel::top("banner").resizable(false).frame(frame);
        let drawn = panel.show(ui, |ui| {
            if let Some(reason) = &picture.shown.marks.invalid {
                banner(ui, &format!("INVALID, evidence of nothing: {}", words::tame_to(reason, MAX_WHY)));
            }
            if picture.untaken {
                banner(ui, "NOT TAKEN: what you did last did not reach this console's core. Hold by other means.");
            }
            if let Some(lag) = picture.behind {
                let stale_text = "NOT CURRENT: this console has drawn nothing new for";
                banner(ui, &format!("{stale_text} {}. Hold by other means.", words::seconds(lag)));
                ui.set_opacity(PAST);
            }
            banner::draw(ui, &mut self.view_state, picture.shown);
            if !has_column(ui) {
                ui.add_space(4.0);
                ui.spacing_mut().item_spacing.y = 0.0;
                units::lines(ui, &mut self.view_state, picture.shown);
            }
        });
        drawn.response.rect.bottom()
    }

    /// HOLD and the other orders, and at the bottom the looks.
    fn rail(&mut self, ui: &mut Ui, shown: &Shown, wishes: &mut Vec<Wish>) {
        let palette = Palette::current(ui);
        let edge = ui.max_rect().left();
        let frame = |x: i8, y: i8| Frame::new().fill(palette.pane).inner_margin(Margin::symmetric(x, y));
        CentralPanel::default().frame(frame(10, 8)).show(ui, |ui| {
            Panel::bottom("looks").resizable(false).frame(frame(0, 2)).show(ui, |ui| self.looks(ui));
            command::draw(ui, &mut self.view_state, shown, wishes);
        });
        ui.painter().vline(edge, ui.max_rect().y_range(), Stroke::new(1.0, palette.line));
    }

    /// The recording's bars, the column of units and the panes.
    fn rest(&mut self, ui: &mut Ui, picture: &Picture<'_>, wishes: &mut Vec<Wish>) {
        let (shown, palette) = (picture.shown, Palette::current(ui));
        let frame = |x: i8, y: i8| Frame::new().fill(palette.pane).inner_margin(Margin::symmetric(x, y));
        let sidecar = picture.sidecar.filter(|sidecar| picture.tape.is_some() && !sidecar.is_empty());
        if let Some(tape) = picture.tape {
            let sidecar = sidecar.map(|_| &mut self.view_state.sidecar);
            let panel = Panel::bottom("replay").resizable(false).frame(frame(8, 4));
            panel.show(ui, |ui| replay::draw(ui, tape, sidecar, wishes));
        }
        if let Some(sidecar) = sidecar.filter(|_| self.view_state.sidecar) {
            let panel = Panel::bottom("beside").resizable(false).frame(frame(8, 4));
            panel.show(ui, |ui| sidecar::draw(ui, &mut self.textures, sidecar));
        }
        if picture.behind.is_some() {
            ui.set_opacity(PAST);
        }
        if has_column(ui) {
            let panel = Panel::left("units").resizable(false).exact_size(UNITS).frame(frame(0, 0));
            panel.show(ui, |ui| self.column(ui, shown));
        }
        CentralPanel::default().frame(Frame::new().fill(palette.ground)).show(ui, |ui| {
            if has_column(ui) && !self.arranged {
                // The reasons stand in the column.
                self.layouts.now().open(Pane::Tracks);
            }
            self.arranged = true;
            if let Some(pane) = self.view_state.open.take() {
                self.layouts.now().open(pane);
            }
            let (view_state, site) = (&mut self.view_state, &self.site);
            self.layouts.now().draw(ui, &mut Panes { view_state, site, shown, wishes });
        });
    }

    /// Units and the reasons for the chosen one's mode, where there is room for them beside the map.
    fn column(&mut self, ui: &mut Ui, shown: &Shown) {
        ui.spacing_mut().item_spacing.y = 0.0;
        let units = shown.units.len() + shown.silent.len();
        let room = (ui.available_height() - REASONS).max(160.0);
        let cards = |ui: &mut Ui| units::cards(ui, &mut self.view_state, shown);
        let scroll =
            ScrollArea::vertical().id_salt("units").max_height(room).min_scrolled_height(room.min(units as f32 * 80.0));
        scroll.show(ui, cards);
        ui.add_space(4.0);
        ui.separator();
        Frame::new().inner_margin(Margin::symmetric(8, 6)).show(ui, |ui| why::draw(ui, &mut self.view_state, shown));
    }

    /// Layout and theme.
    fn looks(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            for preset in Preset::ALL {
                if ui.add(Button::new(RichText::new(preset.name()).small()).small()).clicked() {
                    self.layouts.start_from(preset);
                }
            }
            let dark = ui.visuals().dark_mode;
            if ui.add(Button::new(RichText::new(if dark { "Light" } else { "Dark" }).small()).small()).clicked() {
                ui.ctx().set_theme(if dark { Theme::Light } else { Theme::Dark });
            }
        });
        ui.horizontal_wrapped(|ui| self.layout_menu(ui));
    }

    /// Layouts by the names that they were kept by.
    fn layout_menu(&mut self, ui: &mut Ui) {
        let names: Vec<String> = self.layouts.names().map(str::to_owned).collect();
        for name in &names {
            let button = ui.small_button(name);
            button.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("layout {name}")));
            if button.clicked() {
                self.layouts.turn_to(name);
                self.name.clone_from(name);
            }
        }
        let label = ui.label(RichText::new("keep as").weak().small());
        ui.add(TextEdit::singleline(&mut self.name).char_limit(MAX_NAME).desired_width(84.0)).labelled_by(label.id);
        let name = self.name.trim();
        if ui.add_enabled(self.layouts.takes(name), Button::new("Keep").small()).clicked() {
            self.layouts.keep(name);
        }
        if names.iter().any(|known| known == name) && ui.small_button("Forget").clicked() {
            self.layouts.forget(name);
        }
    }
}

/// True if the window is wide enough for a column of units.
fn has_column(ui: &Ui) -> bool {
    ui.ctx().content_rect().width() >= CARDS
}

/// Banner above everything else.
fn banner(ui: &mut Ui, text: &str) {
    let palette = Palette::current(ui);
    Frame::new().fill(palette.alarm).inner_margin(Margin::symmetric(8, 4)).show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.label(RichText::new(text).size(15.0).strong().color(palette.on_block));
    });
}
