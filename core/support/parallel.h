// core/support/parallel.h: the one door to threads; oneTBB stays behind it.
//
// Results must not depend on the thread count: a body may only write to what its own index range owns, and
// reductions are done by the caller in index order afterwards.
#pragma once

#include <cstddef>
#include <functional>

namespace core {

/// Calls body(begin, end) for disjoint ranges that cover [0, count), each at most `grain` long, in any order
/// and on any thread. Returns when all are done. An exception from a body is rethrown here.
/// @pre grain > 0
void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Runs `work` with at most `thread_count` threads for everything below it, libraries that share oneTBB
/// (OpenVDB, Embree) included. More threads than cores are honoured. 0 means one a core. Under a limit on
/// memory all threads are started first. @throws InputError kOutOfMemory where they do not fit
void with_thread_limit(int thread_count, const std::function<void()>& work);

/// Threads that parallel_for would use here.
int thread_limit();

/// Sets flush-to-zero and denormals-are-zero for this thread while it lives, and restores what was set
/// before. Denormal operands cost microcode assists in traversal kernels.
class ScopedFlushDenormals {
public:
    ScopedFlushDenormals();
    ~ScopedFlushDenormals();
    ScopedFlushDenormals(const ScopedFlushDenormals&) = delete;
    ScopedFlushDenormals& operator=(const ScopedFlushDenormals&) = delete;

private:
    unsigned int previous_;
};

}  // namespace core
