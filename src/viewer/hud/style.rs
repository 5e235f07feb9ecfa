//! How the panels look. Plain on purpose: the rasteriser may be a CPU.

use egui::{Context, CornerRadius, FontId, Shadow, Stroke, TextStyle, TextWrapMode, Theme, Visuals, vec2};

use super::colors::{FILL, TEXT, WEAK};

/// Sets the style up, once for each context.
pub fn style(ctx: &Context) {
    ctx.set_theme(Theme::Dark);
    // Feathered edges have several times the triangles.
    ctx.tessellation_options_mut(|options| options.feathering = false);
    // Plus and minus set the speed, and Ctrl is held to fly slowly.
    ctx.options_mut(|options| options.zoom_with_keyboard = false);
    ctx.style_mut_of(Theme::Dark, |style| {
        style.text_styles = [
            (TextStyle::Small, FontId::proportional(10.0)),
            (TextStyle::Body, FontId::proportional(12.0)),
            (TextStyle::Button, FontId::proportional(12.0)),
            (TextStyle::Heading, FontId::proportional(14.0)),
            (TextStyle::Monospace, FontId::monospace(12.0)),
        ]
        .into();
        style.drag_value_text_style = TextStyle::Body;
        style.wrap_mode = Some(TextWrapMode::Extend);
        style.animation_time = 0.0;
        style.interaction.selectable_labels = false;
        let spacing = &mut style.spacing;
        spacing.item_spacing = vec2(4.0, 2.0);
        spacing.button_padding = vec2(4.0, 1.0);
        spacing.interact_size = vec2(40.0, 18.0);
        spacing.slider_width = 80.0;
        spacing.icon_width = 14.0;
        spacing.icon_width_inner = 8.0;
        spacing.combo_height = 260.0;
        style.visuals = visuals();
    });
}

fn visuals() -> Visuals {
    let mut visuals = Visuals::dark();
    visuals.window_shadow = Shadow::NONE;
    visuals.popup_shadow = Shadow::NONE;
    visuals.window_corner_radius = CornerRadius::ZERO;
    visuals.menu_corner_radius = CornerRadius::ZERO;
    visuals.panel_fill = FILL;
    visuals.window_fill = FILL;
    visuals.weak_text_color = Some(WEAK);
    visuals.text_cursor.blink = false;
    let widgets = &mut visuals.widgets;
    for state in [
        &mut widgets.noninteractive,
        &mut widgets.inactive,
        &mut widgets.hovered,
        &mut widgets.active,
        &mut widgets.open,
    ] {
        state.corner_radius = CornerRadius::ZERO;
        state.fg_stroke = Stroke::new(state.fg_stroke.width, TEXT);
    }
    visuals
}
