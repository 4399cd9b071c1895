// Measures the CPU time that a large scene costs the thread that builds it, while connected.
using System;
using System.Globalization;
using HapticVLM;
using HapticVLM.Wire;

public static class Large
{
    // Prints the CPU time of adding objects and of removing half of them, ms, and the bytes sent for the removal.
    public static int Build(int count)
    {
        var registry = new SceneRegistry();
        registry.Put(new SceneObject { ObjectId = "warm up" });
        registry.Write(new MsgPackWriter(), new RequestIds());
        var ids = new string[count];
        for (int i = 0; i < count; i++) ids[i] = Guid.NewGuid().ToString("N");
        double begun = Machine.ThreadCpuMs();
        foreach (string id in ids) registry.Put(new SceneObject { ObjectId = id, Name = "Chair (3) Wood_Oak" });
        double added = Machine.ThreadCpuMs();
        Sent(registry);
        double sent = Machine.ThreadCpuMs();
        for (int i = 0; i < count / 2; i++) registry.Remove(ids[i]);
        double removed = Machine.ThreadCpuMs();
        Console.WriteLine(string.Format(CultureInfo.InvariantCulture, "added_ms {0:f1} removed_ms {1:f1} bytes {2}", added - begun, removed - sent, Sent(registry)));
        return 0;
    }

    static int Sent(SceneRegistry registry)
    {
        int bytes = 0;
        var writer = new MsgPackWriter();
        while (registry.Write(writer, new RequestIds()))
        {
            bytes += writer.Written.Count;
            writer.Reset();
        }
        return bytes;
    }
}
