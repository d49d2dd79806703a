# Two programs of ours on the chip's default device, each with a master on its slave FIFO that counts: what
# comes in and what goes out is complete and in order, whatever the client does meanwhile.
#
# device: fifo $sot twin fx2 $work/fifo_firmware.ihx --fifo-master counter
# firmware: fifo_firmware.c
# compile: bulk_client.c
# afterwards: 'what went out was read by the FIFO master, in order, but for ends of cancelled writes' counter_arrived fifo 4096

stream() { # stream PORT in|out KIBIBYTES SEED
    local port=$1
    shift
    bulk_client "$(node "$port")" "$@" >/tmp/stream || {
        tail -n 3 /tmp/stream
        return 1
    }
    # Cancelled writes, for the check afterwards.
    sed -n 's/^cancelled/note cancelled/p' /tmp/stream >/dev/console
}

check 'firmware that streams runs as the default device' appears "$fifo" 04b4:8613 480
check 'a counter comes in through AUTOIN' stream "$fifo" in 4096 1
check 'a counter goes out through AUTOOUT' stream "$fifo" out 4096 3
