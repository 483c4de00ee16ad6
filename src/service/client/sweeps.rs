//! Sweeps on a server. They run there whether or not anybody is connected, so a network that fails costs a sweep nothing: the
//! client connects anew and asks again, and what it gets is the whole table.

use super::analyses::{Client, ClientError};
use crate::compile::CompileOptions;
use crate::jobs::sweep::{SweepProgress, SweepSpec, SweepTable};
use crate::netlist::Bundle;
use crate::service::convert::model::bundle_to_wire;
use crate::service::convert::options::options_to_wire;
use crate::service::convert::sweep as sweeps;
use crate::service::ids::Ids;
use crate::service::proto;
use proto::sweep_status::State;
use std::time::Duration;
use tonic::Status;

/// Attempts in a row without a word of the sweep, after which it is given up.
const ATTEMPTS: u32 = 6;
/// Pause before the second attempt; each further one is twice as long.
const PAUSE: Duration = Duration::from_millis(100);

impl Client {
    /// A sweep; `progress` is told how far it has come and may stop it. A connection that fails meanwhile is made anew.
    ///
    /// # Errors
    /// [`ClientError`]; code "Cancelled" when `progress` said stop, "Unavailable" or "DeadlineExceeded" when the server was not
    /// reached again.
    pub fn sweep(
        &mut self,
        spec: &SweepSpec,
        bundle: &Bundle,
        options: &CompileOptions,
        progress: &mut dyn FnMut(SweepProgress) -> bool,
    ) -> Result<SweepTable, ClientError> {
        let request = proto::SubmitSweepRequest {
            bundle: Some(bundle_to_wire(bundle)),
            options: Some(options_to_wire(options)),
            spec: Some(sweeps::spec_to_wire(spec)),
            // an answer that is lost starts no second sweep
            request_id: Ids::default().make().map_err(|status| self.error(&status))?,
        };
        let submitted = self.persist(|client, _| client.call(client.link.rpc.clone().submit_sweep(request.clone())))?;
        let id = submitted.sweep;
        let whole = |client: &Self, right: bool| match right {
            true => Ok(()),
            false => Err(client.error(&Status::unimplemented("it is of an earlier version, which knows no samples"))),
        };
        // a server passes over fields that it does not know
        let outcome = whole(self, spec.point_numbers().is_ok_and(|points| points.len() as u64 == submitted.points))
            .and_then(|()| self.persist(|client, heard| client.follow(&id, heard, progress)))
            .and_then(|()| self.persist(|client, _| client.fetch(&id, submitted.points)))
            .and_then(|table| {
                whole(self, spec.names().eq(table.parameters.iter().map(String::as_str))).map(|()| table)
            });
        // Done with it, whatever came: the server need not keep it. That it is gone already is no error.
        let _ = self.call(self.link.rpc.clone().cancel_sweep(proto::CancelSweepRequest { sweep: id }));
        outcome
    }

    /// Asks again, on a new connection, where the network fails. `ask` says whether it heard that the sweep goes on.
    fn persist<T>(
        &mut self,
        mut ask: impl FnMut(&Self, &mut bool) -> Result<T, ClientError>,
    ) -> Result<T, ClientError> {
        let mut attempts = 0;
        loop {
            let mut heard = false;
            let lost = match ask(self, &mut heard) {
                Err(error) if ["Unavailable", "DeadlineExceeded"].contains(&&*error.code) => error,
                answer => return answer,
            };
            attempts = if heard { 1 } else { attempts + 1 };
            let mut lost = Some(lost);
            while let Some(error) = lost {
                if attempts >= ATTEMPTS {
                    return Err(error);
                }
                std::thread::sleep(PAUSE * (1 << (attempts - 1)));
                lost = self.reconnect().err();
                attempts += u32::from(lost.is_some());
            }
        }
    }

    fn follow(
        &self,
        id: &str,
        heard: &mut bool,
        progress: &mut dyn FnMut(SweepProgress) -> bool,
    ) -> Result<(), ClientError> {
        let mut rpc = self.link.rpc.clone();
        let mut states = self.call(rpc.watch_sweep(proto::WatchSweepRequest { sweep: id.to_owned() }))?;
        while let Some(status) = self.next(&mut states)? {
            *heard = true;
            let proto::SweepStatus { done, points, failed, ref message, .. } = status;
            match status.state() {
                State::Done => {
                    progress(SweepProgress { done, points, failed });
                    return Ok(());
                }
                State::Cancelled => return Err(self.error(&Status::cancelled(message))),
                State::Failed => return Err(self.error(&Status::failed_precondition(message))),
                State::Running | State::Unspecified => {
                    if !progress(SweepProgress { done, points, failed }) {
                        return Err(self.error(&Status::cancelled(format!("after {done} of {points} points"))));
                    }
                }
            }
        }
        Err(self.error(&Status::unavailable("the stream ended before the sweep did")))
    }

    /// The whole table.
    fn fetch(&self, id: &str, points: u64) -> Result<SweepTable, ClientError> {
        let mut rpc = self.link.rpc.clone();
        let mut chunks = self.call(rpc.fetch_sweep(proto::FetchSweepRequest { sweep: id.to_owned() }))?;
        let mut table = SweepTable::default();
        while let Some(chunk) = self.next(&mut chunks)? {
            sweeps::chunk_from_wire(chunk, &mut table)
                .map_err(|v| self.error(&Status::internal(format!("{}: {}", v.field, v.description))))?;
        }
        match table.rows.len() as u64 {
            rows if rows == points => Ok(table),
            rows => Err(self.error(&Status::unavailable(format!("the table ended after {rows} of {points} points")))),
        }
    }
}
