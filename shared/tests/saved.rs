//! Parameters that are saved, and are there again after a start.

use crate::common;
use crate::flash;

use crate::random::Random;
use blindgrasp_shared::identity::Restored;
use blindgrasp_shared::parameter::Text;
use blindgrasp_shared::parameters::{Parameter, Setting};
use blindgrasp_shared::saved::{Order, Saving};
use blindgrasp_shared::store::{Entry, Store, StoreError};
use blindgrasp_shared::tick::Params;
use common::{JOINTS, config, params};
use flash::Memory;

const HAND: u32 = 7;
const FORCE: Parameter = Parameter::gain(0);

fn named(key: &str) -> Parameter {
    Parameter::named(key).unwrap_or_else(|| panic!("there is no {key}"))
}

type HandParams = Params<JOINTS, 3>;

fn file() -> HandParams {
    params(&config())
}

fn store() -> Store<Memory> {
    let mut store = Store::open(Memory::blank(4)).expect("it has the right sectors");
    store.prepare().expect("it has power");
    store
}

/// Ticks until the store tells what became of the set; orders in between.
fn save(
    store: &mut Store<Memory>,
    mut saving: Saving,
    params: &HandParams,
) -> (Result<(), StoreError>, Vec<Order>) {
    let mut orders = Vec::new();
    for _ in 0..1000 {
        let Some(order) = saving.next(params) else { continue };
        orders.push(order);
        let told = store.obey(&order, HAND);
        if told.is_err() || saving.is_over() {
            return (told, orders);
        }
    }
    panic!("it is never over: {orders:?}");
}

/// The parameters after a start, what became of those saved, and the entries that were left out.
fn start(store: Store<Memory>) -> (HandParams, Restored, Vec<Entry>) {
    let mut store = Store::open(store.into_flash()).expect("it can be read");
    let (mut params, mut ignored) = (file(), Vec::new());
    let restored = store.restore(HAND, &mut params, |entry| ignored.push(*entry));
    (params, restored, ignored)
}

fn set(params: &mut HandParams, parameter: Parameter, index: u8, value: f32) {
    params.set(parameter, index, value).expect("it is in range");
}

#[test]
fn what_was_set_is_there_again() {
    let mut params = file();
    set(&mut params, Parameter::DAMPING, 3, 1e-3);
    set(&mut params, Parameter::GRAVITY, 2, 9.81);
    set(&mut params, Parameter::RELEASE_TIME, 0, 77.0);
    // The limit can't be put back before the force: the file's force is beyond it.
    set(&mut params, FORCE, 0, 2.0);
    set(&mut params, named("limits.force_n"), 0, 3.0);
    let mut store = store();
    let (told, orders) = save(&mut store, Saving::DIFFERENCES, &params);
    assert_eq!(told, Ok(()));
    assert_eq!((orders[0], orders.len(), orders[6]), (Order::Begin(5), 7, Order::Finish));
    let (found, restored, ignored) = start(store);
    assert_eq!(found, params);
    assert_eq!((restored, ignored), (Restored { saved: 5, ignored: 0 }, Vec::new()));
}

#[test]
fn any_parameters_are_there_again() {
    let (mut random, mut changed) = (Random::new(4), 0);
    for _ in 0..50 {
        let mut params = file();
        for parameter in Parameter::ALL {
            for index in 0..parameter.count(JOINTS) {
                let Ok(Setting { value, .. }) = params.get(parameter, index) else { continue };
                if random.below(2) == 0 {
                    let mut near = || value * random.between(50, 150) as f32 / 100.0;
                    let (whole, any) = (near().trunc(), near());
                    // Some are refused: looser than the file, or no whole number.
                    let _ = params.set(parameter, index, whole);
                    let _ = params.set(parameter, index, any);
                }
            }
        }
        changed |= params.changed();
        let mut store = store();
        assert_eq!(save(&mut store, Saving::DIFFERENCES, &params).0, Ok(()));
        let (found, restored, _) = start(store);
        assert_eq!((found, restored.ignored), (params, 0));
    }
    assert!(changed.count_ones() > 20, "{changed:b}");
}

#[test]
fn defaults_are_the_file_again() {
    let mut params = file();
    set(&mut params, FORCE, 0, 2.0);
    let mut store = store();
    assert_eq!(save(&mut store, Saving::DIFFERENCES, &params).0, Ok(()));
    let (told, orders) = save(&mut store, Saving::NOTHING, &params);
    assert_eq!((told, orders), (Ok(()), vec![Order::Begin(0), Order::Finish]));
    let (found, restored, _) = start(store);
    assert_eq!((found, restored), (file(), Restored::default()));
}

#[test]
fn what_does_not_fit_is_left_out_and_told() {
    let good = Entry { key: FORCE.key_hash(), index: 0, value: 2.0 };
    let unknown = Entry { key: Text::plain("thumb.warp").hash(), ..good };
    let no_such_joint = Entry { key: Parameter::DAMPING.key_hash(), index: 12, value: 1e-3 };
    let out_of_range = Entry { value: -1.0, index: 1, ..no_such_joint };
    let not_finite = Entry { value: f32::INFINITY, ..out_of_range };
    let mut store = store();
    for order in [
        Order::Begin(5),
        Order::Put(unknown),
        Order::Put(no_such_joint),
        Order::Put(out_of_range),
        Order::Put(good),
        Order::Put(not_finite),
    ] {
        assert_eq!(store.obey(&order, HAND), Ok(()));
    }
    assert_eq!(store.obey(&Order::Finish, HAND), Ok(()));
    let (found, restored, ignored) = start(store);
    let mut expected = file();
    set(&mut expected, FORCE, 0, 2.0);
    assert_eq!(found, expected);
    assert_eq!(restored, Restored { saved: 5, ignored: 4 });
    assert_eq!(ignored, [unknown, no_such_joint, out_of_range, not_finite]);
}

#[test]
fn another_hands_parameters_are_left_out() {
    let mut store = store();
    let entry = Entry { key: FORCE.key_hash(), index: 0, value: 2.0 };
    for order in [Order::Begin(1), Order::Put(entry), Order::Finish] {
        assert_eq!(store.obey(&order, HAND + 1), Ok(()));
    }
    let (found, restored, ignored) = start(store);
    assert_eq!((found, restored, ignored), (file(), Restored { saved: 1, ignored: 1 }, vec![entry]));
}

#[test]
fn a_set_that_fails_is_told_once_and_the_one_before_stays() {
    let mut params = file();
    set(&mut params, FORCE, 0, 2.0);
    let mut store = store();
    assert_eq!(save(&mut store, Saving::DIFFERENCES, &params).0, Ok(()));
    let before = params.clone();
    set(&mut params, FORCE, 0, 3.0);
    while store.free_slots() > 0 {
        assert_eq!(store.begin(HAND, 0), Ok(()));
    }
    assert_eq!(save(&mut store, Saving::DIFFERENCES, &params).0, Err(StoreError::NoSpare));
    let entry = Entry { key: 1, index: 0, value: 1.0 };
    let late = [Order::Put(entry), Order::Finish].map(|order| store.obey(&order, HAND));
    assert_eq!(late, [Err(StoreError::OutOfOrder); 2]);
    assert_eq!(start(store).0, before);
}

/// Another firmware may have had another order.
#[test]
fn a_limit_that_was_saved_before_its_gain_is_there_again() {
    let entry = |key, value| Entry { key: named(key).key_hash(), index: 0, value };
    let mut store = store();
    for order in [
        Order::Begin(2),
        Order::Put(entry("limits.force_n", 3.0)),
        Order::Put(entry("force_n", 2.0)),
        Order::Finish,
    ] {
        assert_eq!(store.obey(&order, HAND), Ok(()));
    }
    let (found, restored, _) = start(store);
    assert_eq!(restored, Restored { saved: 2, ignored: 0 });
    assert_eq!(found.get(named("limits.force_n"), 0).map(|setting| setting.value), Ok(3.0));
}

/// Whatever was saved, the hand's file is the ceiling.
#[test]
fn what_is_looser_than_the_file_is_left_out() {
    let entry = |parameter: Parameter, value| Entry { key: parameter.key_hash(), index: 0, value };
    let looser = [entry(Parameter::TORQUE_LIMIT, 100.0), entry(Parameter::STOP_MARGIN, 0.0)];
    let mut store = store();
    assert_eq!(store.obey(&Order::Begin(2), HAND), Ok(()));
    looser.iter().for_each(|entry| assert_eq!(store.obey(&Order::Put(*entry), HAND), Ok(())));
    assert_eq!(store.obey(&Order::Finish, HAND), Ok(()));
    assert_eq!(start(store), (file(), Restored { saved: 2, ignored: 2 }, looser.to_vec()));
}
