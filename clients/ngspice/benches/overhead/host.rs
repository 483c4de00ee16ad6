//! A host in miniature: the memory of ngspice 39 as a code model sees it, built by hand, with one instance of p ports.

use std::ffi::{c_char, c_int, c_void};
use std::sync::atomic::{AtomicPtr, Ordering};

unsafe extern "C" {
    fn CMdevNum() -> *const c_int;
    fn CMdevs() -> *const *mut u64;
    fn CMgetCoreItfPtr() -> *mut *const *const c_void;
}

type SetUp = unsafe extern "C" fn(*mut c_void, *mut u64, *mut c_void, *mut c_int) -> c_int;

static INSTANCE_SIZE: c_int = 152;
static MODEL_SIZE: c_int = 64;

/// State memory of the instance at this point and at the last one; as large as any bench needs.
static MEMORY: AtomicPtr<[[f64; 64]; 2]> = AtomicPtr::new(std::ptr::null_mut());

unsafe extern "C" fn setup(_: *mut c_void, _: *mut u64, _: *mut c_void, _: *mut c_int) -> c_int {
    0
}
unsafe extern "C" fn reserve(_: c_int, _: c_int) {}
unsafe extern "C" fn memory(_: c_int, point: c_int) -> *mut c_void {
    // SAFETY: the plug-in accesses points 0 and 1, from the one thread of the bench.
    unsafe { (&raw mut (*MEMORY.load(Ordering::Relaxed))[point as usize]).cast() }
}
unsafe extern "C" fn integrate(_: f64, _: *mut f64, _: *mut f64) -> c_int {
    0
}
unsafe extern "C" fn message(_: *mut c_char) -> c_int {
    0
}

unsafe extern "C" fn deck_path() -> *const c_char {
    std::ptr::null()
}

/// Keeps `value` for the rest of the process: a host's structures outlive every call.
fn keep<T>(value: T) -> *mut T {
    Box::leak(Box::new(value))
}

fn pair(low: i32, high: i32) -> u64 {
    u64::from(low as u32) | u64::from(high as u32) << 32
}

/// A loaded plug-in with one instance, ready to be called.
pub(crate) struct Host {
    model: unsafe extern "C" fn(*mut c_void),
    call: *mut [u64; 20],
    voltages: Vec<*mut f64>,
    currents: Vec<*mut f64>,
}

impl Host {
    /// Loads the plug-in and sets up an instance with `ports` ports.
    pub(crate) fn new(ports: usize) -> Self {
        MEMORY.store(keep([[0.0; 64]; 2]), Ordering::Relaxed);
        let mut core: Vec<*const c_void> = vec![std::ptr::null(); 60];
        core[3] = setup as *const c_void;
        core[23] = reserve as *const c_void;
        core[24] = memory as *const c_void;
        core[25] = integrate as *const c_void;
        core[35] = message as *const c_void;
        core[45] = deck_path as *const c_void;
        let mut parameters: Vec<*mut [u64; 4]> = (0..10).map(|_| keep([pair(1, 0), 0, 0, 0])).collect();
        let text = keep([c"none".as_ptr() as u64, 0]);
        // SAFETY: `file` is given, the first of the ten parameters.
        unsafe { *parameters[0] = [pair(0, 1), text as u64, 0, 0] };
        let (mut voltages, mut currents, mut port_data) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..ports {
            let partials = keep([vec![0.0f64; ports].leak().as_mut_ptr() as u64, 0]);
            let data = keep([0u64; 32]);
            // SAFETY: offsets of ngspice 39: input at byte 48, output at 64, partials at 80.
            unsafe {
                (*data)[10] = partials as u64;
                voltages.push((&raw mut (*data)[6]).cast());
                currents.push((&raw mut (*data)[8]).cast());
            }
            port_data.push(data);
        }
        let connection = keep([0, 0, pair(0, 1), pair(1, ports as i32), port_data.leak().as_mut_ptr() as u64]);
        let none = keep([0, 0, pair(1, 0), pair(1, 0), 0]);
        let connections = keep([connection as u64, none as u64]);
        let parameters = std::mem::take(&mut parameters).leak().as_mut_ptr() as u64;
        let instance = keep([0, 0, c"a1".as_ptr() as u64, 0, 2, connections as u64]);
        let model = keep([0, 0, instance as u64, c"m".as_ptr() as u64, 0, 10, parameters]);
        let call = keep([0u64; 20]);
        // SAFETY: the order in which ngspice loads a plug-in; 376 and 136 are the offsets of Debian's ngspice 39.
        unsafe {
            (&mut (*call))[13..17].copy_from_slice(&[2, connections as u64, 10, parameters]);
            CMdevNum();
            let device = *CMdevs();
            *device.add(376 / 8) = &raw const INSTANCE_SIZE as u64;
            *device.add(384 / 8) = &raw const MODEL_SIZE as u64;
            *CMgetCoreItfPtr() = core.leak().as_ptr();
            let set_up: SetUp = std::mem::transmute(*device.add((136 + 24) / 8));
            assert_eq!(set_up(std::ptr::null_mut(), model.cast(), std::ptr::null_mut(), &mut 0), 0);
            let model = std::mem::transmute::<u64, unsafe extern "C" fn(*mut c_void)>(*device.add(72 / 8));
            Self { model, call, voltages, currents }
        }
    }

    /// Calls the model for a step from `before` to `t` (s) (the same: an operating point); returns the first current.
    pub(crate) fn call(&mut self, t: f64, before: f64, v: f64) -> f64 {
        // SAFETY: the structures live as long as the process; the layout is that of a call in ngspice 39.
        unsafe {
            for at in &self.voltages {
                **at = v;
            }
            let call = &mut *self.call;
            call[0] = pair(0, if t > before { 2 } else { 0 });
            call[2] = t.to_bits();
            call[5] = t.to_bits();
            call[6] = before.to_bits();
            (self.model)(self.call.cast());
            *self.currents[0]
        }
    }

    /// Makes the last point the accepted one.
    pub(crate) fn accept(&mut self) {
        // SAFETY: the bench has one thread.
        unsafe {
            let memory = &mut *MEMORY.load(Ordering::Relaxed);
            memory[1] = memory[0];
        }
    }
}
