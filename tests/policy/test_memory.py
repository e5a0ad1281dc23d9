import numpy as np

from policy.memory import LINE, PAGE, zeros


def test_arrays_begin_at_lines_far_apart_in_their_pages():
    arrays = [zeros(30, 7) for _ in range(200)]
    for array in arrays:
        assert array.flags.c_contiguous and array.dtype == np.float32 and not array.any()
        array += 1  # the memory is its own
    places = [array.ctypes.data % PAGE // LINE for array in arrays]
    assert all(array.ctypes.data % LINE == 0 for array in arrays)
    for first in range(190):
        for other in places[first + 1 : first + 10]:
            apart = (other - places[first]) % (PAGE // LINE)
            assert min(apart, PAGE // LINE - apart) >= 4
    assert all((array == 1).all() for array in arrays)
