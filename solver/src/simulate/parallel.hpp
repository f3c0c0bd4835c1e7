// Independent tasks over threads.
#pragma once

#include <cstddef>
#include <functional>

namespace rille {

// Calls work(k) for every k in [0, count) over so many threads (0: one a core). Where one throws, the others stop and the first exception is
// thrown again. keep_going is asked now and then by the calling thread; where it says no, no further task begins.
// Returns whether all tasks were begun and none was called off.
bool parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work,
                  const std::function<bool()>& keep_going = nullptr);

}  // namespace rille
