// What a large scene costs the thread that builds it, while it is connected.
using System;
using System.Globalization;
using HapticVLM;
using HapticVLM.Wire;

public static class Large
{
    // CPU time of adding so many objects and of taking half of them away again, ms, and the bytes sent for that.
    public static int Build(int count)
    {
        var book = new SceneBook();
        book.Put(new SceneObject { ObjectId = "warm up" });
        book.Write(new MsgPackWriter(), new RequestIds());
        var ids = new string[count];
        for (int i = 0; i < count; i++) ids[i] = Guid.NewGuid().ToString("N");
        double begun = Machine.ThreadCpuMs();
        foreach (string id in ids) book.Put(new SceneObject { ObjectId = id, Name = "Chair (3) Wood_Oak" });
        double added = Machine.ThreadCpuMs();
        Sent(book);
        double sent = Machine.ThreadCpuMs();
        for (int i = 0; i < count / 2; i++) book.Remove(ids[i]);
        double removed = Machine.ThreadCpuMs();
        Console.WriteLine(string.Format(CultureInfo.InvariantCulture, "added_ms {0:f1} removed_ms {1:f1} bytes {2}", added - begun, removed - sent, Sent(book)));
        return 0;
    }

    static int Sent(SceneBook book)
    {
        int bytes = 0;
        var writer = new MsgPackWriter();
        while (book.Write(writer, new RequestIds()))
        {
            bytes += writer.Written.Count;
            writer.Reset();
        }
        return bytes;
    }
}
