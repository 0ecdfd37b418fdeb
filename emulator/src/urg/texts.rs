//! The information replies: `VV`, `PP`, `II`, and `V` of SCIP 1.1.
//!
//! ```text
//! KEY:VALUE;S LF …     value formats differ between families, so clients should not parse them strictly
//! ```

use super::encode::{push_info, push_value};
use super::model::{BitRateText, Family, Interface, Model};

/// What `II` reports beside the model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Situation {
    pub laser: bool,
    /// A measurement is running.
    pub measuring: bool,
    pub booting: bool,
    /// Motor speed in rpm, and the level asked for (0 the default).
    pub rpm: u32,
    /// Level of `CR`.
    pub speed_level: u8,
    pub baud: u32,
    pub stamp_ms: u32,
    pub faulty: bool,
}

/// Lines of `VV`.
#[must_use]
pub(crate) fn version(model: &Model) -> Vec<u8> {
    let mut out = Vec::new();
    push_info(&mut out, "VEND", "Hokuyo Automatic Co.,Ltd.");
    push_info(&mut out, "PROD", model.product);
    push_info(&mut out, "FIRM", model.firmware);
    push_info(&mut out, "PROT", model.protocol);
    push_info(&mut out, "SERI", model.serial);
    out
}

/// Lines of `V` in SCIP 1.1: no checksums.
#[must_use]
pub(crate) fn version_scip11(model: &Model) -> Vec<u8> {
    format!(
        "VEND:Hokuyo Automatic Co.,Ltd.\nPROD:{}\nFIRM:{}\nPROT:00003,(SCIP 1.0)\nSERI:{}\n\
         STAT:FW Normal[FinalDist with shadow  ]\n",
        model.product, model.firmware_scip11, model.serial
    )
    .into_bytes()
}

/// Lines of `PP`.
#[must_use]
pub(crate) fn parameters(model: &Model) -> Vec<u8> {
    let geometry = &model.geometry;
    let mut out = Vec::new();
    push_info(&mut out, "MODL", model.model_text);
    push_info(&mut out, "DMIN", &geometry.range_min_mm.to_string());
    push_info(&mut out, "DMAX", &geometry.range_max_mm.to_string());
    push_info(&mut out, "ARES", &geometry.steps_per_turn.to_string());
    push_info(&mut out, "AMIN", &geometry.first_step.to_string());
    push_info(&mut out, "AMAX", &geometry.last_step.to_string());
    push_info(&mut out, "AFRT", &geometry.front_step.to_string());
    push_info(&mut out, "SCAN", &model.rpm().to_string());
    out
}

/// Lines of `II`.
#[must_use]
pub(crate) fn state(model: &Model, now: &Situation) -> Vec<u8> {
    let mut out = Vec::new();
    push_info(&mut out, "MODL", model.model_text);
    push_info(&mut out, "LASR", if now.laser { "ON" } else { "OFF" });
    if model.family == Family::Ust {
        push_info(&mut out, "SCSP", &now.rpm.to_string());
        push_info(&mut out, "MESM", if now.booting { "Booting" } else { "Measuring by Sensitive Mode" });
        push_info(&mut out, "SBPS", &bit_rate(model, now.baud));
        let mut stamp = Vec::new();
        push_value(&mut stamp, now.stamp_ms, 4);
        push_info(&mut out, "TIME", &String::from_utf8_lossy(&stamp));
        push_info(&mut out, "STAT", if now.faulty { "Error 33" } else { "sensor is working normally" });
    } else {
        let speed = if now.speed_level == 0 {
            format!("Initial({}[rpm])<-Default setting by user", now.rpm)
        } else {
            // A level, `%`, four characters, `(`: what hokuyoaist reads (`%hd%%%*4c(%d[rpm])`).
            format!("{}%....({}[rpm])", now.speed_level, now.rpm)
        };
        push_info(&mut out, "SCSP", &speed);
        let mode = match (now.measuring, now.laser) {
            (true, _) => "Measuring by Normal Mode",
            (false, true) => "CLASSIC",
            (false, false) => "IDLE",
        };
        push_info(&mut out, "MESM", mode);
        push_info(&mut out, "SBPS", &bit_rate(model, now.baud));
        push_info(&mut out, "TIME", &format!("{:06X}", now.stamp_ms));
        let health = if now.faulty { "Trouble!! Error No. =[00->33]" } else { "Sensor works well." };
        push_info(&mut out, "STAT", health);
    }
    out
}

/// `SBPS`.
fn bit_rate(model: &Model, baud: u32) -> String {
    match model.bit_rate_text {
        BitRateText::Fixed(text) => text.to_owned(),
        BitRateText::OfLine if model.interface == Interface::Rs232 && baud != model.power_up_baud => {
            format!("{baud}[bps]")
        }
        BitRateText::OfLine => format!("{}[bps]<-Default setting by user", model.power_up_baud),
    }
}
