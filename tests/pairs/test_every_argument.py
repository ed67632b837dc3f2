"""Every public function x every argument x every kind of value: the right answer, or an error that names the argument.

What is right is what float64 copies of the same values give. Whatever raises has written nothing, and nobody is warned.
A test goes through all arguments of a function; a failure names the argument and the value, and does not end it.
"""

import itertools
import warnings

import numpy as np
import pandas as pd
import pytest

import collide

pytestmark = pytest.mark.fast

N = 3
GOOD = {
    "m1": [1.0, 2.0, 3.0],
    "m2": [2.0, 1.0, 1.0],
    "v1": [3.0, 1.0, 2.0],
    "v2": [-1.0, 0.0, 1.0],
    "v1x": [3.0, 1.0, 2.0],
    "v1y": [0.0, 1.0, 0.0],
    "v2x": [-1.0, 0.0, 1.0],
    "v2y": [1.0, 2.0, 0.0],
    "v1z": [1.0, 0.0, 2.0],
    "v2z": [0.0, -1.0, 1.0],
    "nx": [1.0, 2.0, 1.0],
    "ny": [0.0, 1.0, 3.0],
    "nz": [2.0, 0.0, 1.0],
    "theta1": [0.0, 1.0, 2.0],
    "theta2": [3.0, 2.0, 1.0],
    "phi": [0.0, 1.0, 6.0],
    "dx": [5.0, 3.0, 4.0],
    "dy": [0.0, 1.0, 2.0],
    "dz": [0.0, 2.0, 1.0],
    "dvx": [-1.0, -2.0, 1.0],
    "dvy": [0.0, -1.0, 0.0],
    "dvz": [0.0, -2.0, 1.0],
    "distance": [2.0, 1.0, 1.0],
    "restitution": [1.0, 0.0, 1.0],
    "x": [0.0, 1.0, 3.0],
    "y": [0.0, 1.0, 5.0],
    "radius": [1.0, 2.0, 1.0],
    "m": [1.0, 2.0, 3.0],
    "i": [0, 1, 0],
    "j": [1, 2, 2],
}
PLANE = ["m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny", "restitution"]
SPACE = ["m1", "m2", "v1x", "v1y", "v1z", "v2x", "v2y", "v2z", "nx", "ny", "nz", "restitution"]
FUNCTIONS = {
    "resolve_1d": ["m1", "m2", "v1", "v2", "restitution"],
    "resolve_2d": PLANE,
    "resolve_3d": SPACE,
    "resolve_polar": ["m1", "m2", "v1", "theta1", "v2", "theta2", "phi", "restitution"],
    "impulse_2d": PLANE,
    "impulse_3d": SPACE,
    "time_of_impact": ["dx", "dy", "dvx", "dvy", "distance"],
    "time_of_impact_3d": ["dx", "dy", "dz", "dvx", "dvy", "dvz", "distance"],
    "find_contacts": ["x", "y", "radius"],
    "resolve_contacts": ["i", "j", "m", "x", "y", "radius", "restitution"],
    "resolve_pairs": ["i", "j", "m", "restitution"],  # v and n, which have two axes: test_resolve_pairs.py
    "resolve_walls": ["x", "y", "radius", "m", "restitution"],
}
IN_PLACE = ["resolve_contacts", "resolve_pairs", "resolve_walls"]
BATCHES = [name for name in FUNCTIONS if name not in ("find_contacts", *IN_PLACE)]
OPTIONS = {"find_contacts": ["margin", "box"], "resolve_contacts": ["box"], "resolve_walls": ["box"]}
WITH_OPTIONS = {function: [*names, *OPTIONS.get(function, [])] for function, names in FUNCTIONS.items()}


def call(function, values):
    """The answer, as a list of arrays."""
    if function in IN_PLACE:
        walls = function == "resolve_walls"
        vx, vy, impulse = np.array([1.0, 0.0, -1.0]), -np.ones(N) if walls else np.zeros(N), np.full(N + walls, 9.0)
        before = vx.copy(), vy.copy(), impulse.copy()
        values = {"box": (4.0, 6.0), **values} if walls else values
        try:
            if function == "resolve_pairs":
                count = collide.resolve_pairs(**values, v=(vx, vy), n=(1.0, np.arange(N)), impulse=impulse)
            else:
                count = getattr(collide, function)(**values, vx=vx, vy=vy, impulse=impulse)
        except collide.InvalidPairError:
            raise
        except (TypeError, ValueError, IndexError):
            for got, old in zip((vx, vy, impulse), before, strict=True):
                np.testing.assert_array_equal(got, old)
            raise
        return [np.array(count), vx, vy, impulse]
    answer = getattr(collide, function)(**values)
    return list(answer) if isinstance(answer, tuple) else [answer]


def good(function):
    values = {name: np.array(GOOD[name]) for name in FUNCTIONS[function]}
    if function in BATCHES:
        values["m1" if "m1" in values else "dx"] = np.array(GOOD["m1" if "m1" in values else "dx"])
    return values


def byte_swapped(a):
    return a.astype(a.dtype.newbyteorder())


def read_only(a):
    a = a.copy()
    a.flags.writeable = False
    return a


def misaligned(a):
    return np.frombuffer(b"\0" + a.tobytes(), np.uint8)[1:].view(a.dtype)


# The same numbers in another guise.
GUISES = {
    "list": lambda a: a.tolist(),
    "tuple": lambda a: tuple(a.tolist()),
    "list of NumPy scalars": list,
    "Series": pd.Series,
    "Series with another index": lambda a: pd.Series(a, index=[7, 5, 6]),
    "read-only": read_only,
    "byte-swapped": byte_swapped,
    "misaligned": misaligned,
    "misaligned, writable": lambda a: np.frombuffer(bytearray(b"\0" + a.tobytes()), np.uint8)[1:].view(a.dtype),
    "native by name": lambda a: a.view(a.dtype.newbyteorder("<")),
    "negative strides": lambda a: a[::-1].copy()[::-1],
    "strided": lambda a: np.repeat(a, 3)[::3],
    "subclass": lambda a: a.view(np.matrix).A1.view(type("Sub", (np.ndarray,), {})),
    "memoryview": memoryview,
    "array interface": lambda a: type("Other", (), {"__array__": lambda self, dtype=None, copy=None: a})(),
}
INTEGERS = ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"]


@pytest.mark.parametrize("function", FUNCTIONS)
def test_the_same_numbers_in_another_guise(function, subtests):
    for argument, guise in itertools.product(
        FUNCTIONS[function], [*GUISES, *INTEGERS, "f2", "f4", ">f4", "zero strides"]
    ):
        with subtests.test(argument=argument, guise=guise):
            check_guise(function, argument, guise)


def check_guise(function, argument, guise):
    values, plain = good(function), good(function)
    a = values[argument]
    if guise in GUISES:
        values[argument] = GUISES[guise](a)
    elif guise == "zero strides":
        values[argument] = np.broadcast_to(a[0] if argument != "j" else 2, N)
        plain[argument] = np.array(values[argument])
    else:
        if argument in ("i", "j") and "f" in guise:
            with pytest.raises(TypeError, match=f"^{argument} has dtype .*: must have an integer dtype"):
                call(function, values | {argument: a.astype(guise)})
            return
        if "u" in guise:
            a = abs(a)
            plain[argument] = a.astype(plain[argument].dtype)
        values[argument] = a.astype(guise)
    for got, want in zip(call(function, values), call(function, plain), strict=True):
        np.testing.assert_array_equal(got, want)
        assert np.shape(got) == np.shape(want)


NO_NUMBERS = {
    "None": None,
    "str": "heavy",
    "bytes": b"1",
    "object": object(),
    "dict": {"a": 1},
    "set": {1.0, 2.0, 3.0},
    "strings": ["1", "2", "3"],
    "objects": np.array([1.0, None, 2.0], object),
    "complex": 1j,
    "complex array": np.ones(N, complex),
    "longdouble": np.ones(N, np.longdouble),
    "datetime": np.ones(N, "M8[s]"),
    "structured": np.ones(N, [("a", float)]),
    "masked": np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0]),
    "masked in a list": [np.ma.array([1.0, 2.0, 3.0])],
    "ragged": [[1.0, 2.0], [3.0]],
    "generator": (x for x in [1.0, 2.0, 3.0]),
    "too many bits": 10**400,
}


@pytest.mark.parametrize("function", FUNCTIONS)
def test_what_is_no_number_is_a_type_error_that_names_the_argument(function, subtests):
    for argument, kind in itertools.product(WITH_OPTIONS[function], NO_NUMBERS):
        values = good(function) | {argument: NO_NUMBERS[kind]}
        with subtests.test(argument=argument, kind=kind):
            if kind == "None" and (argument == "box" or (function, argument) == ("resolve_contacts", "radius")):
                call(function, values)
                continue
            with pytest.raises(TypeError, match=rf"^{argument}\b"):
                call(function, values)


class Fails:
    """An object that says it is an array and raises this when it is asked for one."""

    def __init__(self, error):
        self.error = error

    def __array__(self, dtype=None, copy=None):
        raise self.error


class OnCuda:
    @property
    def __cuda_array_interface__(self):
        return {"shape": (3,), "typestr": "<f8", "data": (1, False), "version": 3}


class OnCudaAndSaysSo(OnCuda, Fails):
    def __init__(self):
        super().__init__(TypeError("Implicit conversion to a NumPy array is not allowed"))


class OnAnotherDevice:
    def __dlpack_device__(self):
        return 8, 0  # Metal

    def __array__(self, dtype=None, copy=None):
        raise TypeError("can't convert a tensor")


@pytest.mark.parametrize("function", FUNCTIONS)
def test_an_object_that_fails_to_become_an_array_is_named(function, subtests):
    kinds = TypeError, ValueError, RuntimeError, KeyError, AttributeError, OSError, IndexError
    for argument, kind, in_a_list in itertools.product(WITH_OPTIONS[function], kinds, (False, True)):
        error = kind("why not")
        value = [Fails(error)] if in_a_list else Fails(error)
        with subtests.test(argument=argument, kind=kind, in_a_list=in_a_list):
            message = rf"^{argument} = .*: must be an array of numbers \('?why not'?\)$"
            with pytest.raises(TypeError, match=message) as info:
                call(function, good(function) | {argument: value})
            assert info.value.__cause__ is error


@pytest.mark.parametrize("function", FUNCTIONS)
def test_arrays_on_a_device_are_named(function, subtests):
    message = "is of type \\w+, in the memory of a GPU or another device: must be copied to the host first"
    values = OnCuda(), OnCudaAndSaysSo(), OnAnotherDevice(), [OnCuda()]
    for argument, value in itertools.product(WITH_OPTIONS[function], values):
        with subtests.test(argument=argument, value=value), pytest.raises(TypeError, match=f"^{argument} {message}"):
            call(function, good(function) | {argument: value})


@pytest.mark.parametrize("error", [MemoryError(), KeyboardInterrupt()])
def test_what_is_not_the_objects_fault_comes_through(error):
    with pytest.raises(type(error)):
        collide.resolve_1d(1.0, Fails(error), 1.0, 0.0)


@pytest.mark.parametrize("function", OPTIONS)
def test_options_of_any_dtype(function, subtests):
    """As float64 copies of them, and nobody is warned, of the limits of a smaller type neither."""
    for argument, dtype in itertools.product(OPTIONS[function], ["?", *INTEGERS, "f2", "f4", "f8", ">f4"]):
        with subtests.test(argument=argument, dtype=dtype):
            check_option(function, argument, dtype)


def check_option(function, argument, dtype):
    lengths = np.array([1, 1] if dtype == "?" else [100, 120]).astype(dtype)
    option = lengths if argument == "box" else lengths[0]
    values = good(function) | {"x": np.array([0.0, 0.25, 0.5]), "y": np.array([0.0, 0.25, 0.25])}
    values |= {"radius": 0.125} if "radius" in values else {}
    got = call(function, values | {argument: option})
    for u, want in zip(got, call(function, values | {argument: option.astype(np.float64)}), strict=True):
        np.testing.assert_array_equal(u, want)


def test_options_of_float16_are_added_up_in_float64():
    x = np.array([0.0, 1e5])
    assert collide.find_contacts(x, 0 * x, 20_000.0, margin=np.float16(60_000)).i.size == 1


@pytest.mark.parametrize("function", FUNCTIONS)
def test_shapes_that_do_not_match_are_a_value_error_that_names_the_argument(function, subtests):
    for argument, shape in itertools.product(FUNCTIONS[function], [(2,), (4,), (2, 2), (0,)]):
        values = good(function) | {argument: np.ones(shape, int)}
        message = rf"\b{argument}( has shape|,)? \({shape[0]},"
        with subtests.test(argument=argument, shape=shape), pytest.raises(ValueError, match=message):
            call(function, values)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_numbers_and_arrays_without_dimensions(function, subtests):
    for argument in FUNCTIONS[function]:
        values, plain = good(function), good(function)
        number = plain[argument][1]
        plain[argument] = np.full(N, number)
        one = argument in ("m", "radius", "restitution") or function in BATCHES
        for guise in (number, number.item(), np.array(number), np.array([number]), [number]):
            values[argument] = guise
            with subtests.test(argument=argument, guise=guise):
                if one:
                    for got, want in zip(call(function, values), call(function, plain), strict=True):
                        np.testing.assert_array_equal(got, want)
                else:
                    with pytest.raises(ValueError, match=rf"\b{argument}( has shape|,) \((1,)?\)"):
                        call(function, values)


NASTY = [np.nan, np.inf, -np.inf, -0.0, 5e-324, -5e-324, 2.2e-308, 1.7e308, -1.7e308, 1e-160, 1e160]


def scalar_formula(function, values):
    """What collide.scalar gives, pair by pair, for those pairs that obey the rules."""
    columns = [np.broadcast_to(values[name], N) for name in FUNCTIONS[function]]
    with np.errstate(all="ignore"):
        answers = [getattr(collide.scalar, function)(*(float(c[k]) for c in columns)) for k in range(N)]
    return np.array(answers).reshape(N, -1).T


@pytest.mark.parametrize("function", BATCHES)
def test_nasty_numbers(function, subtests):
    for argument, number in itertools.product(FUNCTIONS[function], NASTY):
        with subtests.test(argument=argument, number=number):
            check_nasty_number(function, argument, number)


def check_nasty_number(function, argument, number):
    values = good(function)
    values[argument] = values[argument].copy()
    values[argument][1] = number
    marked = call(function, values | {"invalid": "nan"})
    wrong = np.isnan(marked[0])
    assert not wrong[[0, 2]].any()
    # What stays valid has the bits of the formula; polar form is another matter: NumPy's own sin and cos.
    want = scalar_formula(function, values)
    for got, exact in zip(marked, want, strict=True):
        if function == "resolve_polar":
            np.testing.assert_allclose(got[~wrong], exact[~wrong], rtol=1e-13, atol=1e-13 * abs(exact[~wrong]).max())
        else:
            np.testing.assert_array_equal(got[~wrong], exact[~wrong])
    finite_rule = argument not in ("m1", "m2")
    if np.isnan(number) or (finite_rule and np.isinf(number)):
        assert wrong[1]
    if wrong[1]:
        with pytest.raises(collide.InvalidPairError) as info:
            call(function, values)
        assert (info.value.index, info.value.count) == ((1,), 1)
        assert info.value.reason.startswith(argument) or "too large" in info.value.reason


@pytest.mark.parametrize("argument", ["vx", "vy", "impulse"])
def test_a_ball_state_that_is_read_only(argument):
    """The same kind of error as that of a read-only `out`, below."""
    values = good("resolve_contacts") | {name: np.zeros(N) for name in ("vx", "vy", "impulse")}
    with pytest.raises(ValueError, match=rf"^{argument} is read-only$"):
        collide.resolve_contacts(**values | {argument: read_only(values[argument])})


@pytest.mark.parametrize("function", BATCHES)
@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda u: np.empty(u.size + 1),
            ValueError,
            r"has shape \(4,\): must have the broadcast shape, \(3,\)",
        ),
        (lambda u: np.empty((1, 3)), ValueError, r"has shape \(1, 3\)"),
        (
            lambda u: np.empty(3, np.float32),
            TypeError,
            r"has dtype float32: must have the result's, float64",
        ),
        (lambda u: np.empty(3, int), TypeError, r"has dtype int64"),
        (lambda u: np.empty(3, ">f8"), TypeError, r"has dtype >f8"),
        (lambda u: np.ma.zeros(3), TypeError, r"is of type MaskedArray"),
        (lambda u: [0.0, 0.0, 0.0], TypeError, r"is of type list: must be a NumPy array"),
        (read_only, ValueError, r"is read-only"),
    ],
)
def test_outputs_that_cannot_be_written_to(function, make, error, message):
    values = good(function)
    count = len(call(function, values))
    for k in range(count):
        out = [np.full(N, 9.0) for _ in range(count)]
        out[k] = make(out[k])
        label = rf"^out\[{k}\] " if count > 1 else "^out "
        with pytest.raises(error, match=label + message):
            call(function, values | {"out": tuple(out) if count > 1 else out[0]})
        for u in out[:k] + out[k + 1 :]:
            assert (u == 9.0).all()


@pytest.mark.parametrize("function", [f for f in BATCHES if f.startswith("resolve")])
@pytest.mark.parametrize("shift", [0, 1])
def test_outputs_that_share_memory(function, shift):
    values = good(function)
    count = len(call(function, values))
    memory = np.full(N + 1, 9.0)
    out = [np.full(N, 9.0) for _ in range(count)]
    out[0], out[-1] = memory[:N], memory[shift : shift + N]
    with pytest.raises(ValueError, match=rf"out\[0\] and out\[{count - 1}\] share memory"):
        call(function, values | {"out": tuple(out)})
    assert (memory == 9.0).all()


@pytest.mark.parametrize("function", FUNCTIONS)
def test_options_of_another_type(function):
    values = good(function)
    wrong: object
    if function not in ("find_contacts", "resolve_walls"):
        for wrong in (None, "", "RAISE", 1, ["raise"], np.str_("raise")):
            with pytest.raises(ValueError, match=r"^invalid = .*: must be one of 'raise', "):
                call(function, values | {"invalid": wrong})
    if "restitution" in values and function not in ("resolve_contacts", "resolve_walls"):
        for wrong in (None, "yes", 1, 0.0, [True], np.array([True])):
            with pytest.raises(TypeError, match=r"^approaching_only = .*: must be True or False"):
                call(function, values | {"approaching_only": wrong})


@pytest.mark.parametrize("function", FUNCTIONS)
def test_nobody_is_warned(function):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call(function, good(function))
    assert caught == []
