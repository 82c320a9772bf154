"""One Modbus connection, TCP or RTU, through pymodbus: reads and writes of registers, one error tree.

A request that is lost or damaged on the line is sent again, twice; every request of this driver may be repeated. After
a failure the connection is closed and the next request opens it again, so that no late answer is taken for a new one.
"""

import contextlib
import logging
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusException

from drivers.errors import DeviceError, DeviceLost, DeviceRefused, DeviceStale
from drivers.modbus.register_map import INPUT
from drivers.transports.serial_port import find_port

TIMEOUT_S = 0.25  # of one try; controllers answer within their cycle, some milliseconds; a line of 9600 baud in 0.1 s
RETRIES = 2
EXCEPTIONS = {  # Modbus Application Protocol V1.1b3, section 7
    1: "illegal function",
    2: "illegal data address: the register map does not fit this controller",
    3: "illegal data value",
    4: "device failure",
    5: "acknowledge: still working",
    6: "device busy",
    10: "gateway path unavailable",
    11: "gateway target does not respond",
}
PARITIES = {"none": serial.PARITY_NONE, "even": serial.PARITY_EVEN, "odd": serial.PARITY_ODD}
GONE = (ConnectionException, serial.SerialException, OSError)
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # it logs what is raised below as well


@dataclass(frozen=True)
class TcpAddress:
    """A Modbus TCP server."""

    host: str
    port: int = 502

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


@dataclass(frozen=True)
class RtuAddress:
    """A Modbus RTU line; 8 data bits. `serial_number` of the adapter's USB plug stands in place of its path.

    The specification's own is even parity and 1 stop bit, or none and 2 (Modbus over Serial Line V1.02, 2.5.1).
    """

    serial_port: str | None = None
    baud: int = 115_200
    parity: str = "none"
    stop_bits: int = 1
    serial_number: str | None = None

    def __str__(self) -> str:
        return self.serial_port or f"the adapter {self.serial_number}"

    def port(self) -> str:
        """Its path at this moment. DeviceLost when no plug has the serial number."""
        return self.serial_port if self.serial_port is not None else find_port(self.serial_number or "")


class Client(Protocol):
    """The part of pymodbus that is used here."""

    def connect(self) -> bool: ...
    def close(self) -> None: ...
    def read_holding_registers(self, address: int, *, count: int, device_id: int) -> Any: ...
    def read_input_registers(self, address: int, *, count: int, device_id: int) -> Any: ...
    def write_registers(self, address: int, values: list[int], *, device_id: int) -> Any: ...


class ModbusLine:
    """May be used by several threads; requests go one after the other."""

    def __init__(self, address: TcpAddress | RtuAddress, unit: int = 1, name: str = "robot") -> None:
        self.place = f"{name} at {address} unit {unit}"
        self._address, self._unit = address, unit
        self._turn = threading.Lock()
        self._client: Client | None = None
        self._closed = False  # by its owner: a late request must not open it again, for nobody would close it

    def connect(self) -> None:
        """DeviceLost when nobody is there. The first request shows whether it speaks Modbus."""
        with self._turn:
            self._close()
            self._closed = False
            self._opened()

    def read(self, table: str, address: int, count: int) -> list[int]:
        """Raw registers. DeviceLost, DeviceStale; DeviceRefused with the controller's exception code."""
        with self._turn, self._with_reason(f"reading {count} registers from {address}"):
            client = self._opened()
            ask = client.read_input_registers if table == INPUT else client.read_holding_registers
            answer = self._checked(ask(address, count=count, device_id=self._unit), f"reading {address}")
            words: list[int] = list(answer.registers)
            if len(words) != count:
                raise DeviceStale(f"{self.place}: {len(words)} registers came from {address}, {count} were asked for")
            return words

    def write(self, address: int, words: Sequence[int]) -> None:
        """Raw registers. Raises as `read`."""
        with self._turn, self._with_reason(f"writing {len(words)} registers from {address}"):
            answer = self._opened().write_registers(address, list(words), device_id=self._unit)
            self._checked(answer, f"writing {address}")

    def close(self) -> None:
        """Safe in every state and more than once."""
        with self._turn:
            self._closed = True
            self._close()

    def _opened(self) -> Client:
        if self._client is not None:
            return self._client
        if self._closed:
            raise DeviceLost(f"{self.place}: closed; connect again")
        client = self._new_client()
        if not client.connect():
            client.close()
            raise DeviceLost(
                f"{self.place}: cannot connect; check that the controller is on, [devices.robot] and the cable"
            )
        self._client = client
        return client

    def _new_client(self) -> Client:
        match self._address:
            case TcpAddress(host, port):
                return ModbusTcpClient(host, port=port, timeout=TIMEOUT_S, retries=RETRIES)
            case RtuAddress() as rtu:
                return ModbusSerialClient(
                    rtu.port(),
                    baudrate=rtu.baud,
                    parity=PARITIES[rtu.parity],
                    stopbits=rtu.stop_bits,
                    timeout=TIMEOUT_S,
                    retries=RETRIES,
                )

    def _checked(self, answer: Any, what: str) -> Any:
        if answer.isError():
            code = int(getattr(answer, "exception_code", 0))
            words = EXCEPTIONS.get(code, "unknown exception")
            raise DeviceRefused(f"{self.place}: {what} is refused, code {code} ({words})")
        return answer

    @contextlib.contextmanager
    def _with_reason(self, what: str) -> Any:
        """Whatever the libraries raise, as an error of this program; the connection is closed after one."""
        try:
            yield
        except DeviceRefused:
            raise
        except DeviceError:
            self._close()
            raise
        except GONE as error:
            self._close()
            raise DeviceLost(f"{self.place}: {what}: {error}; check power and cable, then connect again") from error
        except (
            ModbusException,
            ValueError,
            TypeError,
            AttributeError,
        ) as error:  # pyserial and pymodbus, on a lost line
            self._close()
            raise DeviceStale(
                f"{self.place}: {what}: no good answer in {RETRIES + 1} tries of {TIMEOUT_S:.3g} s ({error}); "
                "check unit number, baud rate, parity and cable"
            ) from error

    def _close(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            with contextlib.suppress(OSError, ModbusException):
                client.close()
