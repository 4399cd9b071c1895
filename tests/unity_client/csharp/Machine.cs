// Reads CPU time and allocations of the calling thread.
using System;
using System.Runtime.InteropServices;

public static class Machine
{
    const int ThreadCpuClock = 3; // CLOCK_THREAD_CPUTIME_ID of Linux

    [StructLayout(LayoutKind.Sequential)]
    struct Timespec
    {
        public long Seconds;
        public long Nanoseconds;
    }

    [DllImport("libc", EntryPoint = "clock_gettime")]
    static extern int GetTime(int clock, out Timespec time);

    public static double ThreadCpuMs()
    {
        Timespec time;
        GetTime(ThreadCpuClock, out time);
        return time.Seconds * 1e3 + time.Nanoseconds * 1e-6;
    }

    public static long AllocatedBytes()
    {
        return GC.GetAllocatedBytesForCurrentThread();
    }
}
