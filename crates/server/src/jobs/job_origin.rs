//! Request of a job, and its name.

use super::super::fair_semaphore::client;
use bimorph_base::Bundle;
use bimorph_jobs::content::Fnv;
use bimorph_jobs::sweep::shard::SweepPart;
use bimorph_jobs::sweep::{SweepParameter, SweepSpec, journal};
use bimorph_model::options::CompileOptions;
use bimorph_wire::convert::{self, Violation};
use bimorph_wire::proto;
use prost::Message;
use serde::{Deserialize, Serialize};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Longest name that a client gives to its request (byte).
const LONGEST_REQUEST: usize = 64;

/// Longest stored title of a netlist [character].
const LONGEST_TITLE: usize = 200;

/// Origin of a job, known from its first moment: the stored data beside the request itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct JobOrigin {
    /// Owner: the name of a client.
    pub(super) owner: String,
    /// The client's name for its request; empty: none.
    pub(super) request: String,
    /// Hash of the request.
    pub(super) content: String,
    /// Whether identical requests share one job.
    pub(super) share: bool,
    /// After how long without its client it is cancelled (s); 0: never.
    pub(super) release_after_s: f64,
    /// Place among all jobs of a folder, in the order in which they came.
    pub(super) sequence: u64,
    /// When, since 1970 (ms).
    pub(super) submitted_ms: u64,
    /// Version of the server.
    pub(super) version: String,
    /// Name of the sweep in its journal.
    pub(super) sweep: String,
    /// Of a shard: the content of the column `part`.
    pub(super) part: String,
    /// Id of the model.
    pub(super) model: String,
    /// Root file of the netlist.
    pub(super) netlist: String,
    /// Points that it has to compute.
    pub(super) points: u64,
}

impl JobOrigin {
    /// By the client at hand.
    ///
    /// # Errors
    /// An invalid name or time.
    pub(super) fn by(request: &proto::SubmitJobRequest) -> Result<Self, Violation> {
        let name = &request.request_id;
        if name.len() > LONGEST_REQUEST || !name.bytes().all(|byte| byte.is_ascii_graphic()) {
            let text = format!("expected at most {LONGEST_REQUEST} visible ASCII characters, got {} bytes", name.len());
            return Err(Violation::new("request_id", text));
        }
        if request.share && !name.is_empty() {
            let text = "expected a name of its own or `share`, which names it by what it computes; got both";
            return Err(Violation::new("share", text));
        }
        let release_after_s = convert::number("release_after_s", request.release_after_s, false)?;
        if !(0.0..=1e9).contains(&release_after_s) {
            return Err(Violation::new("release_after_s", format!("expected 0 to 1e9 s, got {release_after_s}")));
        }
        Ok(Self {
            owner: client().name.to_string(),
            request: name.clone(),
            content: String::new(),
            share: request.share,
            release_after_s,
            sequence: 0,
            submitted_ms: now_ms(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            sweep: String::new(),
            part: String::new(),
            model: String::new(),
            netlist: String::new(),
            points: 0,
        })
    }

    /// For this.
    pub(super) fn with(mut self, spec: &SweepSpec, bundle: &Bundle, options: &CompileOptions) -> Self {
        let mut hash = Fnv::default();
        hash.model(bundle, options);
        self.model = format!("{:032x}", hash.value());
        if self.share {
            // a request that is sent again means the job that it began, whichever version answers
            hash.text(&self.version);
        }
        hash.bytes(&self.release_after_s.to_bits().to_le_bytes());
        // equal values are equal in any notation
        let listed = |axis: &SweepParameter| SweepParameter {
            values: axis.values.iter().collect::<Vec<_>>().into(),
            ..axis.clone()
        };
        let spec_listed = SweepSpec { parameters: spec.parameters.iter().map(listed).collect(), ..spec.clone() };
        hash.bytes(&convert::sweep::spec_to_wire(&spec_listed).encode_to_vec());
        self.content = format!("{:032x}", hash.value());
        if self.share {
            self.request.clone_from(&self.content);
        }
        self.sweep = journal::name(spec, bundle, options);
        // an invalid grid has none, and is rejected
        let part = (spec.shard.count > 1).then(|| SweepPart::of(spec, bundle, options).ok()).flatten();
        self.part = part.map(|part| part.to_string()).unwrap_or_default();
        self.netlist = bundle.root.chars().take(LONGEST_TITLE).collect();
        self
    }

    /// Whether another request of the same client refers to the same job: `None` if not, else whether its content is
    /// the same.
    pub(super) fn is(&self, other: &Self) -> Option<bool> {
        let named = !self.request.is_empty() && (&self.request, &self.owner) == (&other.request, &other.owner);
        named.then_some((self.share, &self.content) == (other.share, &other.content))
    }

    /// After how long without its client it is cancelled; none: never.
    pub(super) fn release(&self) -> Option<Duration> {
        (self.release_after_s > 0.0).then(|| Duration::from_secs_f64(self.release_after_s))
    }
}

/// Milliseconds since 1970.
pub(super) fn now_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}
