//! The room in the terminal: walls, people and what the module makes of them, drawn anew with each scan.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::canvas::{Canvas, Circle, Points};
use ratatui::widgets::{Block, Paragraph, Row, Table};

/// A dot of the braille canvas is about twice as high as a character cell is wide per dot.
const CELL_ASPECT: f64 = 2.0;

/// What is drawn.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// The model of the sensor and the scene.
    pub title: String,
    /// What the driver is doing, in a word or two.
    pub sensor_state: String,
    /// How far learning has come, while it goes on.
    pub learning: Option<(u32, u32)>,
    /// Time in the scene, in s.
    pub t_s: f64,
    /// Figures with their names.
    pub figures: Vec<(&'static str, String)>,
    /// Background points in m, x forward, y left.
    pub walls: Vec<[f64; 2]>,
    /// Foreground points in m.
    pub foreground: Vec<[f64; 2]>,
    /// Candidates.
    pub candidates: Vec<Seen>,
    /// Where people truly are, in m.
    pub truth: Vec<[f64; 2]>,
    /// Smallest and largest x and y shown, in m.
    pub bounds: [[f64; 2]; 2],
    /// Colours are wanted.
    pub colour: bool,
}

/// One candidate.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Centre in m.
    pub centre_m: [f64; 2],
    /// One standard deviation, in m.
    pub deviation_m: f64,
    /// Width between its ends, in m.
    pub width_m: f64,
    /// Too narrow for a whole person.
    pub narrow: bool,
}

impl View {
    /// Draws the whole screen.
    pub fn draw(&self, frame: &mut Frame<'_>) {
        let [head, body, foot] =
            Layout::vertical([Constraint::Length(1), Constraint::Min(8), Constraint::Length(1)])
                .areas(frame.area());
        let [map, panel] = Layout::horizontal([Constraint::Min(30), Constraint::Length(38)]).areas(body);
        frame.render_widget(
            Line::from(vec![" kehai ".bold().reversed(), format!(" {}", self.title).into()]),
            head,
        );
        self.draw_map(frame, map);
        self.draw_panel(frame, panel);
        let keys = " q quits · dots: walls and what stands out · ● seen · ○ truth";
        frame.render_widget(Line::from(keys).dim(), foot);
    }

    fn paint(&self, colour: Color) -> Color {
        if self.colour { colour } else { Color::Reset }
    }

    fn draw_map(&self, frame: &mut Frame<'_>, area: Rect) {
        let [low, high] = self.bounds;
        let cells = (f64::from(area.width.max(3) - 2), f64::from(area.height.max(3) - 2) * CELL_ASPECT);
        let metres_per_cell = ((high[1] - low[1]) / cells.0).max((high[0] - low[0]) / cells.1);
        let half = (metres_per_cell * cells.0 / 2.0, metres_per_cell * cells.1 / 2.0);
        let middle = ((low[1] + high[1]) / 2.0, (low[0] + high[0]) / 2.0);
        // The screen's x runs right, the sensor's y left.
        let flip = |points: &[[f64; 2]]| points.iter().map(|p| (-p[1], p[0])).collect::<Vec<_>>();
        let (walls, foreground, truth) = (flip(&self.walls), flip(&self.foreground), flip(&self.truth));
        let canvas = Canvas::default()
            .block(Block::bordered().title(" from above, the sensor looks up "))
            .marker(Marker::Braille)
            .x_bounds([-middle.0 - half.0, -middle.0 + half.0])
            .y_bounds([middle.1 - half.1, middle.1 + half.1])
            .paint(|context| {
                context.draw(&Points { coords: &walls, color: self.paint(Color::DarkGray) });
                context.draw(&Points { coords: &foreground, color: self.paint(Color::Yellow) });
                context.layer();
                for &(x, y) in &truth {
                    context.draw(&Circle { x, y, radius: 0.24, color: self.paint(Color::Blue) });
                }
                context.layer();
                context.print(
                    0.0,
                    0.0,
                    Line::from("▲").style(Style::new().fg(self.paint(Color::Red)).bold()),
                );
                for seen in &self.candidates {
                    let (mark, colour) =
                        if seen.narrow { ("∘", Color::Cyan) } else { ("●", Color::Green) };
                    let style = Style::new().fg(self.paint(colour)).bold();
                    context.print(-seen.centre_m[1], seen.centre_m[0], Line::from(mark).style(style));
                }
            });
        frame.render_widget(canvas, area);
    }

    fn draw_panel(&self, frame: &mut Frame<'_>, area: Rect) {
        let [figures, list] =
            Layout::vertical([Constraint::Length(self.figures.len() as u16 + 5), Constraint::Min(3)])
                .areas(area);
        let mut lines = vec![
            Line::from(vec!["sensor  ".dim(), Span::from(self.sensor_state.as_str()).bold()]),
            Line::from(vec!["time    ".dim(), format!("{:.1} s", self.t_s).into()]),
        ];
        lines.push(match self.learning {
            Some((done, of)) => {
                format!("learning the empty room {done}/{of}").fg(self.paint(Color::Yellow)).into()
            }
            None => "watching".fg(self.paint(Color::Green)).into(),
        });
        for (name, value) in &self.figures {
            lines.push(Line::from(vec![format!("{name:<20}").dim(), value.as_str().into()]));
        }
        frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" module ")), figures);
        let rows = self.candidates.iter().map(|seen| {
            Row::new([
                format!("{:5.2}", seen.centre_m[0]),
                format!("{:5.2}", seen.centre_m[1]),
                format!("{:3.0}", seen.deviation_m * 1000.0),
                format!("{:4.0}", seen.width_m * 1000.0),
                if seen.narrow { "narrow".into() } else { String::new() },
            ])
        });
        let widths = [6, 6, 5, 6, 7].map(Constraint::Length);
        let table = Table::new(rows, widths)
            .header(Row::new(["x m", "y m", "± mm", "w mm", ""]).dim())
            .block(Block::bordered().title(" candidates "));
        frame.render_widget(table, list);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    #[test]
    fn the_screen_shows_the_sensor_and_each_candidate() {
        let seen = |x, y, narrow| Seen { centre_m: [x, y], deviation_m: 0.04, width_m: 0.4, narrow };
        let view = View {
            title: "URG-04LX".into(),
            sensor_state: "streaming".into(),
            candidates: vec![seen(2.0, 1.0, false), seen(2.0, -1.0, true)],
            bounds: [[-1.0, -3.0], [4.0, 3.0]],
            ..View::default()
        };
        let mut terminal = Terminal::new(TestBackend::new(110, 32)).unwrap();
        terminal.draw(|frame| view.draw(frame)).unwrap();
        let text = terminal.backend().to_string();
        let place = |mark: char| {
            text.lines()
                .enumerate()
                .find_map(|(row, line)| Some((row, line.chars().position(|c| c == mark)?)))
                .unwrap()
        };
        let ((wide_row, wide), (narrow_row, narrow)) = (place('●'), place('∘'));
        let (sensor_row, sensor) = place('▲');
        assert_eq!(wide_row, narrow_row);
        assert!(wide < sensor && sensor < narrow, "left is left: {wide} {sensor} {narrow}");
        assert!(wide_row < sensor_row, "forward is up");
        assert!(text.contains("streaming") && text.contains("narrow"));
    }
}
