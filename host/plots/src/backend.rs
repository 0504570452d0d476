//! Lets Plotters draw on a [`Canvas`]. Its own bitmap backend has neither round joints nor fractions of a pixel in text.

use blindgrasp_view::canvas::Canvas;
use blindgrasp_view::palette::Rgb;
use blindgrasp_view::text::{self, Anchor, Turn};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontTransform,
};
use std::convert::Infallible;

/// A canvas as Plotters sees it.
pub(super) struct Pen<'a>(pub(super) &'a mut Canvas);

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

fn parts(colour: BackendColor) -> (Rgb, f32) {
    ([colour.rgb.0, colour.rgb.1, colour.rgb.2], colour.alpha as f32)
}

/// The methods that Plotters needs; the rest of its trait has default methods that end in `draw_pixel`.
impl DrawingBackend for Pen<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.0.width as u32, self.0.height as u32)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, colour: BackendColor) -> Drawn {
        let (colour, alpha) = parts(colour);
        self.0.blend(x, y, colour, alpha);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let points: Vec<(f32, f32)> = path.into_iter().map(|(x, y)| (x as f32, y as f32)).collect();
        let (colour, alpha) = parts(style.color());
        if !points.is_empty() && alpha > 0.0 {
            self.0.stroke(&points, style.stroke_width() as f32, colour, alpha);
        }
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let (colour, _) = parts(style.color());
        if fill {
            self.0.fill(from, to, colour);
            return Ok(());
        }
        self.draw_path([from, (to.0, from.1), to, (from.0, to.1), from], style)
    }

    fn draw_text<S: BackendTextStyle>(&mut self, words: &str, style: &S, at: BackendCoord) -> Drawn {
        let em = (style.size() / text::SIZE_PER_EM) as f32;
        // The offsets of Plotters' SVG files, so that both kinds of file look alike.
        let below = match style.anchor().v_pos {
            VPos::Top => 0.76,
            VPos::Center => 0.27,
            VPos::Bottom => -0.27,
        };
        let anchor = match style.anchor().h_pos {
            HPos::Left => Anchor::Left,
            HPos::Center => Anchor::Centre,
            HPos::Right => Anchor::Right,
        };
        let turn = match style.transform() {
            FontTransform::Rotate270 => Turn::Up,
            _ => Turn::None,
        };
        let (colour, _) = parts(style.color());
        text::draw(self.0, words, at, below * em, em, anchor, turn, colour);
        Ok(())
    }
}
