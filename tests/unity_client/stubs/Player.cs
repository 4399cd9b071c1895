// The player loop of the stubs: calls the components' messages in the engine's order, and measures
// their cost: bytes allocated and CPU time of the main thread.
using System;
using System.Collections.Generic;
using System.Reflection;
using System.Runtime.InteropServices;
using UnityEngine;
using Object = UnityEngine.Object;

// Runs callbacks posted to the main thread once per frame.
public sealed class MainThread : System.Threading.SynchronizationContext
{
    readonly Queue<Action> posted = new Queue<Action>();

    public override void Post(System.Threading.SendOrPostCallback call, object state)
    {
        lock (posted) posted.Enqueue(() => call(state));
    }

    public void Run()
    {
        while (true)
        {
            Action next;
            lock (posted)
            {
                if (posted.Count == 0) return;
                next = posted.Dequeue();
            }
            next();
        }
    }
}

public static class Player
{
    static readonly MainThread Main = new MainThread();

    sealed class Calls
    {
        public MonoBehaviour Of;
        public bool IsStarted;
        public Action FixedUpdate, Update, LateUpdate;
    }

    static readonly List<Calls> Live = new List<Calls>();

    public static int Frame;
    public static long AllocatedBytes, StandInBytes; // the second are the stand-in's own
    public static double LongestMs;
    static double tickMs, physicsS;

    public static void Start(MonoBehaviour one)
    {
        System.Threading.SynchronizationContext.SetSynchronizationContext(Main);
        if (ReferenceEquals(one, null)) return;
        Live.Add(new Calls { Of = one, FixedUpdate = Message(one, "FixedUpdate"), Update = Message(one, "Update"), LateUpdate = Message(one, "LateUpdate") });
        if (!Application.isPlaying)
        {
            Call(one, "Reset"); // as when a person adds it in the editor
            return;
        }
        Call(one, "Awake");
        Switch(one);
    }

    // From edit mode: every component of the scene wakes.
    public static void PressPlay()
    {
        Application.isPlaying = true;
        foreach (Calls calls in Live.ToArray())
        {
            Call(calls.Of, "Awake");
            Switch(calls.Of);
        }
    }

    public static void Switch(MonoBehaviour one)
    {
        if (ReferenceEquals(one, null) || !Application.isPlaying && !one.WasEnabled || one.isActiveAndEnabled == one.WasEnabled) return;
        one.WasEnabled = one.isActiveAndEnabled;
        Call(one, one.WasEnabled ? "OnEnable" : "OnDisable");
    }

    public static void Destroy(Object dead)
    {
        var one = dead as MonoBehaviour;
        if (!ReferenceEquals(one, null)) End(one);
        var texture = dead as RenderTexture;
        if (!ReferenceEquals(texture, null)) texture.Release();
        var whole = dead as GameObject;
        dead.IsDead = true;
        if (ReferenceEquals(whole, null)) return;
        foreach (Component part in whole.Parts) Destroy(part);
    }

    public static void Tick(float seconds = 1f / 72f)
    {
        Frame++;
        Time.unscaledTime += seconds;
        Time.unscaledDeltaTime = seconds;
        physicsS += seconds * Time.timeScale;
        tickMs = 0.0;
        Main.Run();
        for (int i = 0; i < Live.Count; i++) Begin(Live[i]);
        for (; physicsS >= Time.fixedDeltaTime; physicsS -= Time.fixedDeltaTime)
        {
            for (int i = 0; i < Live.Count; i++) Measured(Live[i], Live[i].FixedUpdate);
            Contacts.Step();
        }
        for (int i = 0; i < Live.Count; i++) Measured(Live[i], Live[i].Update);
        for (int i = 0; i < Live.Count; i++) Measured(Live[i], Live[i].LateUpdate);
        UnityEngine.Rendering.AsyncGPUReadback.Pump();
        LongestMs = Math.Max(LongestMs, tickMs);
    }

    // Draws the GUI of all components.
    public static void DrawGui()
    {
        GUILayout.Labels.Clear();
        foreach (Calls calls in Live.ToArray()) if (calls.Of.isActiveAndEnabled) Call(calls.Of, "OnGUI");
    }

    // Sends a message with an argument, as physics and the system do.
    public static void Send(GameObject to, string message, params object[] arguments)
    {
        foreach (Component part in to.Parts.ToArray()) Call(part, message, arguments);
    }

    public static void ResetFigures()
    {
        AllocatedBytes = 0;
        LongestMs = 0.0;
    }

    static void End(MonoBehaviour one)
    {
        Live.RemoveAll(calls => ReferenceEquals(calls.Of, one));
        if (one.WasEnabled) Call(one, "OnDisable");
        one.WasEnabled = false;
        Call(one, "OnDestroy");
    }

    static void Begin(Calls calls)
    {
        if (calls.IsStarted || !calls.Of.isActiveAndEnabled) return;
        calls.IsStarted = true;
        Call(calls.Of, "Start");
    }

    static void Measured(Calls calls, Action message)
    {
        if (message == null || !calls.Of.isActiveAndEnabled) return;
        long bytes = GC.GetAllocatedBytesForCurrentThread() - StandInBytes;
        double before = ThreadCpuMs();
        message();
        tickMs += ThreadCpuMs() - before;
        AllocatedBytes += GC.GetAllocatedBytesForCurrentThread() - StandInBytes - bytes;
    }

    static Action Message(MonoBehaviour one, string name)
    {
        MethodInfo method = Find(one, name);
        return method == null ? null : (Action)Delegate.CreateDelegate(typeof(Action), one, method);
    }

    static void Call(object one, string name, params object[] arguments)
    {
        MethodInfo method = Find(one, name);
        if (method != null) method.Invoke(one, arguments);
    }

    static MethodInfo Find(object one, string name)
    {
        return one.GetType().GetMethod(name, BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic);
    }

    [StructLayout(LayoutKind.Sequential)]
    struct Timespec
    {
        public long Seconds;
        public long Nanoseconds;
    }

    [DllImport("libc", EntryPoint = "clock_gettime")]
    static extern int GetTime(int clock, out Timespec time);

    static double ThreadCpuMs()
    {
        Timespec time;
        GetTime(3, out time); // CLOCK_THREAD_CPUTIME_ID of Linux
        return time.Seconds * 1e3 + time.Nanoseconds * 1e-6;
    }
}
