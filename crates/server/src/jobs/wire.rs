//! A job as a message.

use super::job_origin::JobOrigin;
use super::job_state::JobState;
use bimorph_jobs::sweep::SweepSpec;
use bimorph_wire::proto;

/// A job, which outlives the server or not. Repeated status messages omit the options, which may be long.
pub(super) fn job(
    id: &str,
    asked: &JobOrigin,
    provenance: proto::Provenance,
    (standing, kept): (&JobState, bool),
) -> proto::Job {
    let end = standing.end.as_ref();
    let metadata = proto::JobMetadata {
        state: standing.state.into(),
        points: asked.points,
        rows: standing.rows,
        failed: standing.failed,
        submitted: Some(timestamp(asked.submitted_ms)),
        ended: end.map(|end| timestamp(end.ended_ms)),
        request_id: asked.request.clone(),
        release_after_s: asked.release_after_s,
        kept,
        provenance: Some(provenance),
    };
    let result = end.map(|end| match end.code {
        0 => proto::job::Result::Response(proto::JobResponse { rows: standing.rows, failed: standing.failed }),
        code => {
            let (message, details) = (end.message.clone(), Vec::new());
            proto::job::Result::Error(tonic_types::Status { code, message, details })
        }
    });
    proto::Job { name: format!("jobs/{id}"), metadata: Some(metadata), done: end.is_some(), result }
}

/// Provenance of a job's rows, without the options.
pub(super) fn provenance(asked: &JobOrigin, spec: &SweepSpec) -> proto::Provenance {
    proto::Provenance {
        version: asked.version.clone(),
        netlist: asked.netlist.clone(),
        model: asked.model.clone(),
        options: None,
        sweep: asked.sweep.clone(),
        part: asked.part.clone(),
        seed: spec.samples.as_ref().map(|samples| samples.asked.seed),
    }
}

fn timestamp(ms: u64) -> prost_types::Timestamp {
    // 300 million years
    let seconds = i64::try_from(ms / 1000).unwrap_or(i64::MAX);
    prost_types::Timestamp { seconds, nanos: i32::try_from(ms % 1000).unwrap_or(0) * 1_000_000 }
}
