// Plays golden cases with the C# player: `baked.exe FEEL` reads cases and prints them with its plans. `baked.exe FILE identity`
// answers the queries of a file; `baked.exe FEEL heard` reads {rate, voice, block, touches: [{block, touch}], blocks} and prints the samples.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using HapticVLM.Baked;
using Map = System.Collections.Generic.Dictionary<string, object>;

public static class PlayFeel
{
    public static int Main(string[] arguments)
    {
        if (arguments[arguments.Length - 1] == "identity")
        {
            Console.WriteLine("[" + string.Join(",", Identified(File.ReadAllText(arguments[0]))) + "]");
            return 0;
        }
        Feel feel = Feel.Open(File.ReadAllText(arguments[0]));
        if (arguments.Length > 1)
        {
            Console.WriteLine("[" + Text(Rendered(feel, (Map)Json.Parse(Console.In.ReadToEnd()))) + "]");
            return 0;
        }
        var cases = (List<object>)Json.Parse(Console.In.ReadToEnd());
        Console.WriteLine("[" + string.Join(",", cases.Select(one => Played(feel, (Map)one))) + "]");
        return 0;
    }

    // Answers the queries of tests/identity_cases.json: [id, surface, by], or the nearest id.
    private static IEnumerable<string> Identified(string file)
    {
        BakedScene bake = BakedScene.Open(file);
        foreach (Map each in ((List<object>)((Map)Json.Parse(file))["queries"]).Cast<Map>().Select(one => (Map)one["ask"]))
        {
            Func<string, object> value = name => each.ContainsKey(name) ? each[name] : null;
            var query = new BakeQuery { ObjectId = (string)value("object_id"), Material = (string)value("material") };
            query.Paths = ((List<object>)value("paths") ?? new List<object>()).Cast<string>().ToArray();
            query.Primitive = (int?)(double?)value("primitive");
            query.Surface = (int?)(double?)value("surface") ?? 0;
            query.Engine = (string)value("engine") ?? query.Engine;
            BakeFound found = bake.Find(query);
            yield return found == null ? "\"" + bake.Nearest(query.ObjectId) + "\"" : "[\"" + found.ObjectId + "\"," + found.Surface + ",\"" + found.By + "\"]";
        }
    }

    private static string Played(Feel feel, Map one)
    {
        var player = new FeelPlayer(feel);
        var events = ((List<object>)one["events"]).Select(each => Played(player, (Map)each));
        return "{\"name\":\"" + one["name"] + "\",\"events\":[" + string.Join(",", events) + "]}";
    }

    private static string Played(FeelPlayer player, Map each)
    {
        double now = (double)each["at_s"];
        object value;
        if (each.TryGetValue("touch", out value)) player.Touch(TouchOf((Map)value), now);
        else if (each.ContainsKey("stop")) player.Stop();
        else
        {
            var hand = (string)each["plan"];
            return "{\"at_s\":" + Text(now) + ",\"amplitude\":" + Text(player.Plan(hand, "amplitude", now)) + ",\"parametric\":" + Text(player.Plan(hand, "parametric", now)) + "}";
        }
        return "{}";
    }

    // Through the ring, as a speaker plays them.
    private static IEnumerable<double> Rendered(Feel feel, Map asked)
    {
        double rate = (double)asked["rate"], block = (double)asked["block"];
        var heard = new Heard(feel, (int)rate, (string)asked["voice"] == "true" ? HeardVoice.True : HeardVoice.Sound);
        var ring = new SampleRing();
        List<Map> touches = ((List<object>)asked["touches"]).ConvertAll(each => (Map)each);
        var samples = new List<double>();
        for (int at = 0; at < (double)asked["blocks"]; at++)
        {
            double now = at * block / rate;
            foreach (Map each in touches.Where(one => (double)one["block"] == at)) heard.Touch(TouchOf((Map)each["touch"]), now);
            if (!heard.IsSilent) ring.Write(heard.Render((int)block, now), 1.0);
            var channels = new float[2 * (int)block];
            ring.AddTo(channels, 2);
            for (int sample = 0; sample < block; sample++) samples.Add(0.5 * (channels[2 * sample] + channels[2 * sample + 1]));
        }
        return samples;
    }

    private static FeltTouch TouchOf(Map touch)
    {
        object surface, interaction;
        touch.TryGetValue("object_id", out surface);
        touch.TryGetValue("interaction", out interaction);
        return new FeltTouch
        {
            Phase = (string)touch["phase"],
            Hand = (string)touch["hand"],
            Interaction = (string)interaction,
            SpeedMps = Number(touch["speed_mps"]),
            ForceN = Number(touch["force_n"]),
            Surface = surface == null ? null : new FeltSurface { Material = (string)surface },
        };
    }

    // Numbers that JSON lacks come as text.
    private static double Number(object value)
    {
        return value is string ? double.Parse((string)value, CultureInfo.InvariantCulture) : (double)value;
    }

    private static string Text(FeltPlan plan)
    {
        var transients = plan.Transients.Select(one => "[" + Text(one.Amplitude) + "," + Text(one.FrequencyHz) + "]");
        return "{\"amplitude\":[" + Text(plan.Amplitude) + "],\"frequency_hz\":[" + Text(plan.FrequencyHz) + "],\"transients\":[" + string.Join(",", transients) + "]}";
    }

    private static string Text(IEnumerable<double> values)
    {
        return string.Join(",", values.Select(Text));
    }

    private static string Text(double value)
    {
        return value.ToString("R", CultureInfo.InvariantCulture);
    }
}
