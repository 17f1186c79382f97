//! Which model a stream's packets are of: by their identifying bytes, and by the packet period where
//! those are not believed.

use crate::packet::{Head, MODELS, Misfit, Model, ModelRef, PacketKind, claimants};
use crate::time::Timestamp;

/// Packets after which a stream is decided.
const ENOUGH: usize = 32;
/// The packet period of the data may differ from the model's by this share.
const PERIOD_TOLERANCE: f64 = 0.25;

/// What a stream is.
#[derive(Debug, Clone)]
pub struct Choice {
    /// The likeliest model.
    pub model: ModelRef,
    /// Ids of the others that it may be as well.
    pub candidates: Vec<&'static str>,
    /// Ids of models with the same header, left out for what the packets hold.
    pub left_out: Vec<&'static str>,
    /// What the packets leave open.
    pub doubt: Option<String>,
    /// Whether there were too few packets to tell the candidates apart.
    pub is_early: bool,
}

impl Choice {
    fn one(model: ModelRef) -> Self {
        let candidates = model.candidates().to_vec();
        Self {
            model,
            candidates,
            left_out: Vec::new(),
            doubt: None,
            is_early: false,
        }
    }

    fn among(models: &[ModelRef]) -> Option<Self> {
        let (model, others) = models.split_first()?;
        let mut choice = Self::one(*model);
        for other in others.iter().map(|other| other.id()) {
            if !choice.candidates.contains(&other) {
                choice.candidates.push(other);
            }
        }
        Some(choice)
    }
}

/// Data packets of a stream that is not decided yet.
#[derive(Debug, Default)]
pub struct Probe {
    packets: Vec<(Timestamp, Vec<u8>)>,
    named: Option<ModelRef>,
    /// Single units that the user's files describe.
    units: Vec<ModelRef>,
}

impl Probe {
    /// `named` is the model that the user gave, `units` are the single units that files describe.
    pub fn new(named: Option<ModelRef>, mut units: Vec<ModelRef>) -> Self {
        units.retain(|unit| named.is_none_or(|named| named.covers(*unit)));
        Self {
            packets: Vec::new(),
            named,
            units,
        }
    }

    /// Whether the user named the model.
    pub fn is_named(&self) -> bool {
        self.named.is_some()
    }

    /// Takes a datagram if it may be a data packet of some lidar.
    pub fn offer(&mut self, arrival: Timestamp, payload: &[u8]) -> bool {
        let is_claimed = match self.named {
            Some(model) => model.fits(payload),
            None => claimants(payload).next().is_some(),
        };
        let is_unit = |unit: &ModelRef| unit.recognise(payload) == Some(PacketKind::Data);
        let is_claimed = is_claimed || self.units.iter().any(is_unit);
        if is_claimed {
            self.packets.push((arrival, payload.to_vec()));
        }
        is_claimed
    }

    /// Whether there is enough to decide.
    pub fn is_enough(&self) -> bool {
        self.packets.len() >= ENOUGH
    }

    /// The model; `None` where no packet came or none of the models fits.
    ///
    /// A model whose bytes are not believed has to have the packet period of the data, and of several
    /// that do the nearest is taken. Where there are too few packets to tell, all are candidates.
    pub fn decide(&self) -> Option<Choice> {
        let mut choice = self.choose()?;
        let payloads = self.packets.iter().map(|(_, payload)| payload.as_slice());
        let own = payloads.filter(|payload| choice.model.head(payload).is_some());
        if let Some(model) = choice.model.as_sent(&own.collect::<Vec<_>>()) {
            choice.model = model;
        }
        Some(choice)
    }

    fn choose(&self) -> Option<Choice> {
        self.packets.first()?;
        if let Some(unit) = self.unit() {
            return Some(Choice::one(unit));
        }
        if let Some(model) = self.named {
            return Some(Choice::one(model));
        }
        let claimants = self.suited();
        let is_sure = |model: &&ModelRef| self.own(**model).all(|payload| model.is_sure(payload));
        let sure: Vec<ModelRef> = claimants.iter().filter(is_sure).copied().collect();
        if let Some(mut choice) = Choice::among(&sure) {
            choice.left_out = self.left_out(&claimants);
            choice.doubt = choice
                .model
                .doubt(&self.own(choice.model).collect::<Vec<_>>());
            return Some(choice);
        }
        let errors: Vec<Option<f64>> = claimants.iter().map(|m| self.period_error(*m)).collect();
        if errors.iter().all(Option::is_none) {
            let is_early = claimants.len() > 1;
            return Choice::among(&claimants).map(|choice| Choice { is_early, ..choice });
        }
        let known = claimants
            .iter()
            .zip(&errors)
            .filter_map(|(model, error)| Some((*model, (*error)?)));
        let fitting = known.filter(|(_, error)| *error < PERIOD_TOLERANCE);
        let nearest = fitting.min_by(|(_, one), (_, other)| one.total_cmp(other));
        nearest.map(|(model, _)| Choice::one(model))
    }

    /// The single unit whose packets these are: the only one that is sure of them, else the only one that
    /// takes them at all.
    fn unit(&self) -> Option<ModelRef> {
        let most = self
            .units
            .iter()
            .map(|unit| self.own(*unit).count())
            .max()?;
        let takes = |unit: &&ModelRef| most > 0 && self.own(**unit).count() == most;
        let is_sure = |unit: &ModelRef| self.own(*unit).all(|payload| unit.is_sure(payload));
        let (sure, other): (Vec<ModelRef>, Vec<ModelRef>) = self
            .units
            .iter()
            .filter(takes)
            .partition(|unit| is_sure(unit));
        match (&sure[..], &other[..]) {
            ([only], _) | ([], [only]) => Some(*only),
            _ => None,
        }
    }

    /// Ids of the claimants that are not among the suited ones.
    fn left_out(&self, suited: &[ModelRef]) -> Vec<&'static str> {
        let claimants = self.claimants().into_iter();
        let is_suited = |id: &str| suited.iter().any(|model| model.id() == id);
        let others = claimants.filter(|model| !is_suited(model.id()));
        others.map(Model::id).collect()
    }

    /// Claimants whose packets, taken together, look like theirs; all of them where none do.
    fn suited(&self) -> Vec<ModelRef> {
        let claimants = self.claimants();
        let suits = |model: &&ModelRef| model.suits(&self.own(**model).collect::<Vec<_>>());
        let suited: Vec<ModelRef> = claimants.iter().filter(suits).copied().collect();
        if suited.is_empty() { claimants } else { suited }
    }

    /// Models that claim the most of the packets: a stray one does not count.
    fn claimants(&self) -> Vec<ModelRef> {
        let count = |model: &ModelRef| self.own(*model).count();
        let most = MODELS.iter().map(count).max().unwrap_or(0).max(1);
        let likely = MODELS.iter().filter(|model| count(model) == most);
        likely.copied().collect()
    }

    /// Data packets of a model.
    fn own(&self, model: ModelRef) -> impl Iterator<Item = &[u8]> {
        let payloads = self.packets.iter().map(|(_, payload)| payload.as_slice());
        payloads.filter(move |payload| model.recognise(payload) == Some(PacketKind::Data))
    }

    /// Why nothing was decided although packets were claimed, and the model of their size whose packet
    /// period they have.
    pub fn doubt(&self) -> Option<Misfit> {
        let model = self.claimants().into_iter().next()?;
        let found_us = self.period_ns(model)? / 1000.0;
        let title = model.title();
        let why = format!("the bytes fit {title}, the packet period of {found_us:.0} us does not");
        let fitting = MODELS.iter().copied().filter(|model| {
            let mut payloads = self.packets.iter().map(|(_, payload)| payload);
            payloads.all(|payload| model.fits(payload))
        });
        let errors = fitting.filter_map(|model| Some((model, self.period_error(model)?)));
        let near = errors.filter(|(_, error)| *error < PERIOD_TOLERANCE);
        let nearest = near.min_by(|(_, one), (_, other)| one.total_cmp(other));
        Some(Misfit {
            why,
            may_be: nearest.map(|(model, _)| model.id()),
        })
    }

    /// The packets taken so far, in the order of arrival.
    pub fn into_packets(self) -> Vec<(Timestamp, Vec<u8>)> {
        self.packets
    }

    /// How far the packet period of the data is off the model's, as a share; `None` where there are too
    /// few packets to tell.
    fn period_error(&self, model: ModelRef) -> Option<f64> {
        let mut payloads = self.packets.iter().map(|(_, payload)| payload);
        let head = payloads.find_map(|payload| model.head(payload))?;
        let period_ns = model.period_ns(head.return_mode) as f64;
        Some((self.period_ns(model)? / period_ns - 1.0).abs())
    }

    /// Median step of device time; `None` for fewer than three steps.
    fn period_ns(&self, model: ModelRef) -> Option<f64> {
        let payloads = self.packets.iter().map(|(_, payload)| payload);
        let heads: Vec<Head> = payloads.filter_map(|payload| model.head(payload)).collect();
        let steps = heads
            .windows(2)
            .map(|pair| pair[1].device_ns - pair[0].device_ns);
        let mut steps: Vec<i64> = steps.filter(|step| *step > 0).collect();
        steps.sort_unstable();
        (steps.len() >= 3).then(|| steps[steps.len() / 2] as f64)
    }
}
