"""A bad day between the simulated devices and the readers: relays that lose, damage and repeat."""

import os
import random
import select
import socket
import threading
import time
import tty


class SerialRelay:
    """Passes bytes between two serial lines: `device`, which another program made, and `name`,
    which it makes for the reader."""

    def __init__(self, device, name):
        self.device, self.name = device, name
        self.pulled = False     # Nothing passes.
        self.garbage = 0.0      # Probability of a burst of random bytes before a chunk.
        self.damage = 0.0       # Of a chunk to have one byte changed.
        self.repeat = 0.0       # Of a chunk to come twice.
        self.random = random.Random(1)
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        os.symlink(os.ttyname(self.slave), name)
        self.stopped = False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def close(self):
        self.stopped = True
        self.thread.join()
        os.unlink(self.name)

    def run(self):
        line = None
        while not self.stopped:
            if line is None:
                try:
                    line = os.open(self.device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
                    tty.setraw(line)
                except OSError:
                    line = None
                    time.sleep(0.02)
                    continue
            try:
                for ready in select.select([line, self.master], [], [], 0.05)[0]:
                    chunk = os.read(ready, 4096)
                    if not chunk:
                        raise OSError("the device went away")
                    if not self.pulled:
                        self.send(self.master if ready == line else line, chunk)
            except OSError:
                os.close(line)
                line = None

    def send(self, fd, chunk):
        if self.random.random() < self.damage:
            place = self.random.randrange(len(chunk))
            chunk = chunk[:place] + bytes([self.random.randrange(256)]) + chunk[place + 1:]
        if self.random.random() < self.garbage:
            chunk = self.random.randbytes(self.random.randrange(1, 200)) + b"\r\n" + chunk
        if self.random.random() < self.repeat:
            chunk += chunk
        try:
            os.write(fd, chunk)
        except BlockingIOError:
            pass


class DatagramRelay:
    """Passes datagrams from one port of this machine to another."""

    def __init__(self, from_port, to_port):
        self.silent = False
        self.loss = 0.0     # Probabilities, of each datagram.
        self.repeat = 0.0
        self.swap = 0.0     # To come after the next.
        self.garbage = 0.0
        self.random = random.Random(2)
        self.to = ("127.0.0.1", to_port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind(("127.0.0.1", from_port))
        self.socket.settimeout(0.05)
        self.stopped = False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def close(self):
        self.stopped = True
        self.thread.join()
        self.socket.close()

    def run(self):
        held = None
        while not self.stopped:
            try:
                datagram = self.socket.recv(1 << 16)
            except TimeoutError:
                continue
            if self.silent or self.random.random() < self.loss:
                continue
            if self.random.random() < self.garbage:
                self.socket.sendto(self.random.randbytes(self.random.randrange(9000)), self.to)
            if held is None and self.random.random() < self.swap:
                held = datagram
                continue
            self.socket.sendto(datagram, self.to)
            if held is not None:
                self.socket.sendto(held, self.to)
                held = None
            if self.random.random() < self.repeat:
                self.socket.sendto(datagram, self.to)
