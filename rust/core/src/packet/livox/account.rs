//! What a stream's own packets say beside points: what its clock follows, points that the sensor marks as
//! doubtful, and directions that its settings leave out.

use super::points::RawPoint;
use super::sensor::Livox;
use super::shots::Sync;
use crate::packet::UnitFacts;
use crate::packet::unit::{Gather, UnitFile};

/// First word of the account.
const MAGIC: &str = "livox-account";
/// Brightness of points outside of the field of view that a Mid-360 was set to.
const CROPPED: u8 = 60;

/// What is to be said of single returns.
const SINGLE: &str =
    "a single return is the first or the strongest, as the sensor was set: its packets do not tell";

/// Sums over the data packets of a stream.
#[derive(Debug)]
pub struct Account {
    model: Livox,
    points: u64,
    doubtful: u64,
    cropped: u64,
    echoes: usize,
    sync: Option<Sync>,
}

impl Account {
    /// An empty account of a sensor.
    pub fn new(model: Livox) -> Self {
        Self {
            model,
            points: 0,
            doubtful: 0,
            cropped: 0,
            echoes: 0,
            sync: None,
        }
    }

    fn add(&mut self, point: &RawPoint, is_none: bool) {
        let is_doubtful = point.tag & self.model.protocol.doubt_bits() != 0;
        self.points += u64::from(!is_none);
        self.doubtful += u64::from(!is_none && is_doubtful);
        self.cropped += u64::from(is_none && point.reflectivity == CROPPED);
    }
}

impl Gather for Account {
    fn take(&mut self, payload: &[u8]) {
        let Some(packet) = self.model.read(payload) else {
            return;
        };
        self.sync = Some(packet.sync);
        self.echoes = self.echoes.max(packet.form.echoes);
        for shot in packet.shots() {
            for echo in 0..packet.form.echoes {
                let point = packet.form.read(shot, echo);
                self.add(&point, packet.form.is_none(&point));
            }
        }
    }

    fn file(&self) -> Option<UnitFile> {
        let sync = self.sync?;
        let mut lines = vec![MAGIC.into(), format!("the clock {}", sync.describe())];
        if self.echoes == 1 {
            lines.push(SINGLE.into());
        }
        let (points, doubtful, cropped) = (self.points, self.doubtful, self.cropped);
        if doubtful > 0 {
            lines.push(format!(
                "{doubtful} of {points} points carry a tag of the sensor that doubts them (noise, rain, edges); they are kept"
            ));
        }
        if cropped > 0 {
            lines.push(format!(
                "{cropped} shots without a point outside of the field of view that the sensor was set to"
            ));
        }
        Some(UnitFile::new("data packets", lines.join("\n")))
    }
}

/// Whether a file is an account.
pub fn takes(file: &UnitFile) -> bool {
    file.content.starts_with(MAGIC.as_bytes())
}

/// What an account tells.
pub fn describe(files: &[UnitFile]) -> UnitFacts {
    let account = files.iter().find(|file| takes(file));
    let text = account.and_then(UnitFile::text).unwrap_or_default();
    UnitFacts {
        return_mode: text.lines().any(|line| line == SINGLE).then_some("single"),
        notes: text.lines().skip(1).map(Into::into).collect(),
    }
}
