// Describes scenes from lines of text and touches their objects, against the real service.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Threading;
using HapticVLM;
using HapticVLM.Wire;

public static class SceneCases
{
    const int Fields = 4;

    // Lines: "put ID NAME MATERIAL TEMPERATURE" (empty: not stated), "touch ID", "end"; separated by tabs.
    // Prints of each scene what was felt and what was left out, and "end".
    public static int Feel(string url, TextReader lines)
    {
        var scene = new ScriptedScene(url);
        HapticConnection connection = scene.Connection;
        connection.Arrivals.LeftOut += part => Console.WriteLine("left_out " + part.Path);
        connection.Outbox.Scene.Cut += (id, text) => Console.WriteLine("left_out " + id);
        scene.WaitUntil(() => connection.State == LinkState.Ready, "no welcome");
        var known = new List<string>();
        for (string line = lines.ReadLine(); line != null; line = lines.ReadLine())
        {
            string[] words = line.Split('\t');
            if (words[0] == "put") known.Add(Put(connection.Outbox.Scene, words));
            else if (words[0] == "touch") Console.WriteLine("felt " + words[1] + " " + Touch(scene, words[1]));
            else
            {
                Console.WriteLine("end");
                foreach (string id in known) connection.Outbox.Scene.Remove(id);
                known.Clear();
                scene.Materials.Clear();
            }
        }
        Console.WriteLine("errors " + string.Join("|", scene.Errors.ToArray()));
        scene.End();
        return 0;
    }

    static string Put(SceneRegistry registry, string[] words)
    {
        if (words.Length != Fields + 1) throw new ArgumentException("a line has " + (words.Length - 1) + " fields and needs " + Fields);
        var described = new SceneObject { ObjectId = words[1] };
        if (words[2].Length > 0) described.Name = words[2];
        if (words[3].Length > 0) described.Material = words[3];
        if (words[4].Length > 0) described.TemperatureC = double.Parse(words[4], CultureInfo.InvariantCulture);
        registry.Put(described);
        return words[1];
    }

    static string Touch(ScriptedScene scene, string id)
    {
        scene.Connection.Outbox.Wake();
        double until = Clock.Now + 60.0;
        while (!scene.Materials.ContainsKey(id) && Clock.Now < until)
        {
            scene.Turn(() => scene.Touch(Phase.Contact, id));
            scene.Turn(() => scene.Touch(Phase.Release, id));
            Thread.Sleep(20);
        }
        string material;
        return scene.Materials.TryGetValue(id, out material) ? material : "nothing";
    }
}
