//! Streams about a job: where it stands, its rows as they come, and, once it is done, its table.

use super::super::pace::{CHUNK_BYTES, HEARTBEAT};
use super::super::shared::SendingPermit;
use super::super::shutdown::Shutdown;
use super::super::status;
use super::job::Job;
use super::job_state::JobState;
use super::rows::RowCursor;
use bimorph_jobs::sweep::SweepTable;
use bimorph_wire::convert::sweep::row_to_wire;
use bimorph_wire::proto;
use prost::Message;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio_stream::Stream;
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::WaitForCancellationFutureOwned;
use tonic::Status;

/// Time between two messages about where a job stands.
const WATCH_INTERVAL: Duration = Duration::from_millis(100);
/// Time in which rows gather for one message.
const GATHERING: Duration = Duration::from_millis(20);

type ReplyStream<T> = Pin<Box<ReceiverStream<Result<T, Status>>>>;
/// Where a job stands, again and again.
pub(in super::super) type JobStream = ReplyStream<proto::Job>;
/// The same for older clients.
pub(in super::super) type SweepStream = ReplyStream<proto::SweepStatus>;
/// Rows as they come.
pub(in super::super) type RowStream = ReplyStream<proto::JobRows>;

/// Next event of a watched job.
enum JobChange {
    Told,
    Quiet,
    /// There is nothing more to send.
    Over(Option<Status>),
}

/// Waits until there is something new, or for a heartbeat.
async fn next<T>(
    standing: &mut watch::Receiver<JobState>,
    sender: &mpsc::Sender<Result<T, Status>>,
    shutdown: &Shutdown,
) -> JobChange {
    tokio::select! {
        changed = standing.changed() => if changed.is_ok() { JobChange::Told } else { JobChange::Over(None) },
        () = tokio::time::sleep(HEARTBEAT) => JobChange::Quiet,
        () = sender.closed() => JobChange::Over(None),
        () = shutdown.ending.cancelled() => JobChange::Over(Some(status::stopping())),
    }
}

/// One watcher less of a job: rows of one that has ended need not stay in memory. They have left it when this returns, and so when the
/// client sees its stream end: what it requests next is read from the disk.
async fn unwatched(job: &Arc<Job>, standing: watch::Receiver<JobState>) {
    drop(standing);
    if job.has_ended() {
        let job = Arc::clone(job);
        // it may block on a reader of the disk
        let _ = tokio::task::spawn_blocking(move || job.unload()).await;
    }
}

/// Sends the reason for the end of a stream, if a receiver is left.
fn say_last<T>(sender: &mpsc::Sender<Result<T, Status>>, why: Option<Status>) {
    if let Some(why) = why {
        let _ = sender.try_send(Err(why));
    }
}

/// Where a job stands, as `say` has it, until it has ended.
pub(super) fn watch<T: Send + 'static>(job: Arc<Job>, shutdown: &Shutdown, say: fn(&Job) -> T) -> ReplyStream<T> {
    let (sender, receiver) = mpsc::channel(1);
    let (mut standing, shutdown) = (job.watch(), shutdown.clone());
    tokio::spawn(async move {
        // the sender is dropped with this block, after the rows
        loop {
            let now = standing.borrow_and_update().clone();
            let last = now.end.is_some() || now.gone;
            let said =
                if now.gone && now.end.is_none() { Err(status::not_found("job", &job.id)) } else { Ok(say(&job)) };
            if sender.send(said).await.is_err() || last {
                break;
            }
            if let JobChange::Over(why) = next(&mut standing, &sender, &shutdown).await {
                say_last(&sender, why);
                break;
            }
            tokio::time::sleep(WATCH_INTERVAL).await;
        }
        unwatched(&job, standing).await;
    });
    Box::pin(ReceiverStream::new(receiver))
}

/// Rows of a job from the first one wanted on, until it has ended, or those alone that are there now. A reader that is slow holds a place
/// and two messages, and no thread.
pub(super) fn rows(
    job: Arc<Job>,
    (first, only_finished): (u64, bool),
    place: SendingPermit,
    shutdown: &Shutdown,
) -> RowStream {
    let (sender, receiver) = mpsc::channel(1);
    let (mut standing, shutdown) = (job.watch(), shutdown.clone());
    tokio::spawn(async move {
        let _place = place;
        send_rows(&job, (first, only_finished), &mut standing, &sender, &shutdown).await;
        unwatched(&job, standing).await;
    });
    Box::pin(ReceiverStream::new(receiver))
}

async fn send_rows(
    job: &Arc<Job>,
    (first, only_finished): (u64, bool),
    standing: &mut watch::Receiver<JobState>,
    sender: &mpsc::Sender<Result<proto::JobRows, Status>>,
    shutdown: &Shutdown,
) {
    let mut reading = RowCursor::from(first);
    let mut quiet = false;
    loop {
        let now = standing.borrow_and_update().clone();
        if now.gone {
            let _ = sender.send(Err(status::not_found("job", &job.id))).await;
            return;
        }
        while reading.next < now.rows || !reading.begun || std::mem::take(&mut quiet) {
            let (before, begun) = (reading.next, reading.begun);
            let (mut message, back) = chunk(job, reading, now.rows).await;
            reading = back;
            if begun && before < now.rows && reading.next == before {
                // its rows are gone
                message = Err(status::not_found("job", &job.id));
            }
            let failed = message.is_err();
            let sent = tokio::select! {
                sent = sender.send(message) => sent.is_ok(),
                () = shutdown.ending.cancelled() => {
                    let _ = sender.try_send(Err(status::stopping()));
                    false
                }
            };
            if failed || !sent {
                return;
            }
        }
        if now.end.is_some() || only_finished {
            let last = proto::JobRows { first_row: reading.next, job: Some(job.to_wire()), ..Default::default() };
            let _ = sender.send(Ok(last)).await;
            return;
        }
        match next(standing, sender, shutdown).await {
            JobChange::Told => tokio::time::sleep(GATHERING).await,
            JobChange::Quiet => quiet = true,
            JobChange::Over(why) => {
                say_last(sender, why);
                return;
            }
        }
    }
}

/// The next message of a stream: on a thread of its own, as it may read a disk.
async fn chunk(job: &Arc<Job>, mut reading: RowCursor, end: u64) -> (Result<proto::JobRows, Status>, RowCursor) {
    let job = Arc::clone(job);
    let made = tokio::task::spawn_blocking(move || {
        let chunk = job.chunk(&mut reading, end);
        (chunk, reading)
    });
    made.await.unwrap_or_else(|_| (Err(status::fault()), RowCursor::default()))
}

/// A table on its way: columns first, then rows in as few messages as fit, each made when the one before is taken. A
/// reader that is slow holds a place, one message and its share in the table, and no thread.
pub(in super::super) struct TableStream {
    table: Arc<SweepTable>,
    /// Rows sent; none before the first message.
    sent: Option<usize>,
    ending: Pin<Box<WaitForCancellationFutureOwned>>,
    _place: SendingPermit,
}

impl TableStream {
    /// A table from its first row on.
    pub(super) fn new(table: Arc<SweepTable>, place: SendingPermit, shutdown: &Shutdown) -> Self {
        Self { table, sent: None, ending: Box::pin(shutdown.ending.clone().cancelled_owned()), _place: place }
    }

    fn next(&mut self) -> Option<proto::SweepChunk> {
        let table = &self.table;
        let mut chunk = proto::SweepChunk::default();
        let first = self.sent.is_none();
        if first {
            chunk.parameters.clone_from(&table.parameters);
            chunk.results.clone_from(&table.results);
            chunk.units.clone_from(&table.units);
        }
        let mut bytes = chunk.encoded_len();
        let mut sent = self.sent.unwrap_or(0);
        for row in table.rows.get(sent..).unwrap_or_default() {
            let row = row_to_wire(row);
            bytes += row.encoded_len() + 8;
            if bytes > CHUNK_BYTES && !chunk.rows.is_empty() {
                break;
            }
            chunk.rows.push(row);
            sent += 1;
        }
        self.sent = Some(sent);
        (first || !chunk.rows.is_empty()).then_some(chunk)
    }
}

impl Stream for TableStream {
    type Item = Result<proto::SweepChunk, Status>;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let over = self.sent.is_some_and(|sent| sent >= self.table.rows.len());
        if !over && self.ending.as_mut().poll(cx).is_ready() {
            self.sent = Some(usize::MAX);
            return Poll::Ready(Some(Err(status::stopping())));
        }
        Poll::Ready(self.next().map(Ok))
    }
}
