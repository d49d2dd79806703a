//! Streams through the slave FIFO: a master that counts, a host that checks, and the bus's own limit
//! between them.

mod common;

use common::{Bench, Program};
use fx2::Fx2;
use fx2::host::{Host, HostError, Link};
use fx2::slave::Fifo;
use sim::{MS, Ps, SECOND};

/// A chip whose FIFO master writes a counter to EP6 at every edge it can, or reads EP2 likewise.
struct Counter {
    fx2: Fx2,
    board: Bench,
    next_word: u16,
    /// From when on the master has not worked yet.
    from: Ps,
    /// It works at all.
    on: bool,
    /// Words read from EP2.
    read: Vec<u16>,
}

impl Counter {
    fn new(program: &Program) -> Self {
        Self {
            fx2: program.start(),
            board: Bench::default(),
            next_word: 0,
            from: 0,
            on: false,
            read: Vec::new(),
        }
    }

    fn master(&mut self, until: Ps) {
        self.from = self.from.max(until.saturating_sub(MS));
        if self.fx2.slave_can_write(Fifo::Ep6) {
            let words: Vec<u16> = (0..2000).map(|n| self.next_word.wrapping_add(n)).collect();
            let burst = self.fx2.slave_write(Fifo::Ep6, &words, self.from, until);
            self.next_word = self.next_word.wrapping_add(burst.words as u16);
            self.from = burst.next;
        }
        if self.fx2.slave_can_read(Fifo::Ep2) {
            let mut words = [0; 2000];
            let burst = self.fx2.slave_read(Fifo::Ep2, &mut words, self.from, until);
            self.read.extend_from_slice(&words[..burst.words]);
            self.from = burst.next;
        }
    }
}

impl Link for Counter {
    fn fx2(&mut self) -> &mut Fx2 {
        &mut self.fx2
    }

    fn run_until(&mut self, t: Ps) {
        while self.fx2.now() < t {
            self.fx2.run_until(t, &mut self.board);
        }
        if self.on {
            self.master(t);
        }
    }
}

/// Slave FIFO at 30 MHz, 16 bits; EP6 quad IN with AUTOIN, or EP2 quad OUT with AUTOOUT. Then idle.
fn program(input: bool) -> Program {
    let program = Program::new().xdata(0xE601, 0xA3).xdata(0xE60B, 0x00);
    let program = if input {
        program
            .xdata(0xE612, 0x22)
            .xdata(0xE614, 0xE0)
            .xdata(0xE604, 0x80)
            .xdata(0xE604, 0x06)
            .xdata(0xE604, 0x00)
            .xdata(0xE624, 0x02)
            .xdata(0xE625, 0x00)
            .xdata(0xE61A, 0x09)
    } else {
        program.xdata(0xE614, 0x62).xdata(0xE612, 0xA0).xdata(0xE618, 0x01).xdata(0xE618, 0x11)
    };
    program.xdata(0xE618 + if input { 0 } else { 2 }, 0x01).idle()
}

/// Megabytes a simulated second from EP6, all packets complete and in order.
fn measure(packets_per_microframe: u8) -> f64 {
    let mut bench = Counter::new(&program(true));
    let mut host = Host::new();
    host.set_packet_limit(packets_per_microframe);
    host.reset(&mut bench);
    bench.on = true;
    let start = bench.fx2.now();
    let (mut expected, mut bytes) = (0u16, 0);
    while bench.fx2.now() < start + 20 * MS {
        let packet = host.bulk_in(&mut bench, 6).unwrap();
        assert_eq!(packet.len(), 512);
        for pair in packet.chunks_exact(2) {
            assert_eq!(u16::from_le_bytes([pair[0], pair[1]]), expected);
            expected = expected.wrapping_add(1);
        }
        bytes += packet.len();
    }
    assert_eq!(bench.fx2.diagnostics(), []);
    bytes as f64 / ((bench.fx2.now() - start) as f64 / SECOND as f64) / 1e6
}

#[test]
fn a_counter_streams_at_the_rate_of_the_bus() {
    let full = measure(13);
    assert!((53.0..53.3).contains(&full), "13 x 512 x 8000 = 53.248 MB/s, measured {full}");
    let eleven = measure(11);
    assert!((44.9..45.1).contains(&eleven), "11 x 512 x 8000 = 45.056 MB/s, measured {eleven}");
}

#[test]
fn a_stalling_host_loses_nothing() {
    let mut bench = Counter::new(&program(true));
    let mut host = Host::new();
    host.reset(&mut bench);
    bench.on = true;
    let mut expected = 0u16;
    for round in 0..200u64 {
        for _ in 0..round % 7 {
            let packet = host.bulk_in(&mut bench, 6).unwrap();
            for pair in packet.chunks_exact(2) {
                assert_eq!(u16::from_le_bytes([pair[0], pair[1]]), expected, "round {round}");
                expected = expected.wrapping_add(1);
            }
        }
        let until = bench.fx2.now() + (round * 37 % 11) * MS / 20;
        bench.run_until(until);
    }
    assert!(expected > 0);
}

#[test]
fn what_the_host_writes_reaches_the_master_in_order() {
    let mut bench = Counter::new(&program(false));
    let mut host = Host::new();
    host.reset(&mut bench);
    bench.on = true;
    let mut sent = Vec::new();
    for n in 0..100u16 {
        let words: Vec<u16> = (0..256).map(|k| n * 256 + k).collect();
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        host.bulk_out(&mut bench, 2, &bytes).unwrap();
        sent.extend_from_slice(&words);
    }
    let until = bench.fx2.now() + MS;
    bench.run_until(until);
    assert!(bench.read == sent, "{} of {} words", bench.read.len(), sent.len());
}

#[test]
fn a_host_without_a_reader_behind_it_gets_nak_and_gives_up() {
    let mut bench = Counter::new(&program(true));
    let mut host = Host::new();
    host.set_budget(5 * MS);
    host.reset(&mut bench);
    bench.on = true;
    bench.run_until(30 * MS);
    assert_eq!(host.bulk_in(&mut bench, 8), Err(HostError::Timeout(5)));
    assert_eq!(host.bulk_in(&mut bench, 2), Err(HostError::NoResponse(0x82)));
}

#[test]
fn flags_show_full_and_empty_and_packet_end_sends_what_is_there() {
    let mut bench = Counter::new(&program(true));
    let mut host = Host::new();
    bench.fx2.run_until(MS, &mut bench.board);
    bench.fx2.usb_reset();
    bench.fx2.usb_reset_done(fx2::Speed::High);
    let fx2 = &mut bench.fx2;
    // FLAGB full, FLAGC empty, active low.
    assert_eq!(fx2.slave_flags(Fifo::Ep6) & 6, 0b010);
    let words = [0x1234; 2000];
    let burst = fx2.slave_write(Fifo::Ep6, &words, MS, MS + 3_333_300);
    assert_eq!(burst.words, 100, "IFCLK edges in 3.33 us");
    assert_eq!(fx2.slave_flags(Fifo::Ep6) & 6, 0b110);
    let burst = fx2.slave_write(Fifo::Ep6, &words, burst.next, 2 * MS);
    assert_eq!(burst.words, 4 * 256 - 100, "four buffers");
    assert_eq!(fx2.slave_flags(Fifo::Ep6) & 6, 0b000);
    assert!(!fx2.slave_can_write(Fifo::Ep6));
    let mut data = [0; fx2::PACKET_MAX];
    assert_eq!(fx2.usb_in(6, &mut data), fx2::InReply::Data { length: 512, toggle: false });
    fx2.slave_write(Fifo::Ep6, &words[..3], burst.next, 2 * MS);
    assert!(fx2.slave_packet_end(Fifo::Ep6));
    for _ in 0..3 {
        fx2.usb_in(6, &mut data);
    }
    assert_eq!(fx2.usb_in(6, &mut data), fx2::InReply::Data { length: 6, toggle: false });
    host.set_budget(MS);
}

#[test]
fn a_copy_of_a_chip_in_mid_stream_goes_on_alike() {
    let mut bench = Counter::new(&program(true));
    let mut host = Host::new();
    host.reset(&mut bench);
    bench.on = true;
    for _ in 0..17 {
        host.bulk_in(&mut bench, 6).unwrap();
    }
    let go_on = |mut bench: Counter, mut host: Host| {
        let packets: Vec<_> = (0..50).map(|_| host.bulk_in(&mut bench, 6).unwrap()).collect();
        (packets, bench.fx2.now())
    };
    let copy = Counter {
        fx2: bench.fx2.clone(),
        board: bench.board.clone(),
        next_word: bench.next_word,
        from: bench.from,
        on: bench.on,
        read: bench.read.clone(),
    };
    let copied_host = host.clone();
    assert!(go_on(bench, host) == go_on(copy, copied_host));
}
