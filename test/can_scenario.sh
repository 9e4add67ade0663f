#!/bin/sh
# What can_test.py runs where there is CAN: the links' own tests, then the bridge and a simulated
# vehicle on vcan0 while the bus is disturbed. As root, in a network of its own, in an empty folder;
# what is left there tells how it went. Usage: can_scenario.sh BIN INPUTS
set -eu
bin=$1 inputs=$2

ip link set lo up
ip link set lo multicast on
ip route add 239.0.0.0/8 dev lo
"$bin/link_test" --gtest_filter='SocketCan*' >link_test.txt 2>&1 || true

ip link add vcan0 type vcan
ip link set vcan0 up
candump -L -D -r 4194304 vcan0 >can.log 2>candump.txt &
candump=$!
lcm-logger --quiet -f lcm.log >logger.txt 2>&1 &
logger=$!
sleep 1
"$bin/vog-nav-bridge" --config "$inputs/run.toml" --set bus.clock=message 2>bridge.txt &
bridge=$!
sleep 1
"$bin/vog-sim" --config "$inputs/run.toml" 2>sim.txt &
sim=$!

mark() { cansend vcan0 "7F0#$1"; }
await() {  # Until the bus has said PATTERN so often.
  until [ "$(grep -c "$2" can.log)" -ge "$1" ]; do
    kill -0 $sim
    kill -0 $bridge
    sleep 0.2
  done
}
stop=' 210#000000000000'
await 1 ' 145#'
mark 01
# Commands for 4 s, none until the bridge has stopped the vehicle, commands again for 15 s.
lcm-logplayer "$inputs/control-1.log" >player.txt 2>&1
await 1 "$stop"
lcm-logplayer "$inputs/control-2.log" >>player.txt 2>&1 &
player=$!
sleep 2
mark 02
for frame in 7FF#0102 121#0102030405060708 121#00 122#R 111##1AA 00000110#0102030405060708 \
             210#FFFFFFFFFFFFFFFF 20000004#0001000000000000; do
  cansend vcan0 "$frame"
done
cangen vcan0 -g 0 -n 2000 -I 145 -L 8
sleep 1.5
mark 03
ip link set vcan0 down
sleep 3
ip link set vcan0 up
# Controllers that say they are off: both sides, which have opened the bus again within 5 s, do so once
# more.
sleep 6
cansend vcan0 20000040#0000000000000000
sleep 1
mark 04
wait $player
# Commands that were held after the outage look like stops too.
stops=$(grep -c "$stop" can.log)
await $((stops + 1)) "$stop"
sleep 2
mark 05
kill -INT $bridge $sim
wait $bridge
wait $sim
sleep 1
kill -INT $candump $logger
wait $candump $logger || true
