// A mesh of three surfaces with texture maps: prints the hashes that are stated, what is decided, and what it cost.
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using HapticVLM;
using HapticVLM.Wire;
using UnityEngine;
using UnityEngine.Rendering;
using Object = UnityEngine.Object;

public static class TextureRooms
{
    static readonly string[] Names = { "mat14", "Oak_Floor", "mat15" };

    // The folder has for each map NAME.rgba (pixels), NAME.drawn.rgba (as they are sent) and NAME.jpg (the same, encoded).
    static void Run(string url, string folder, string named)
    {
        string[] sizes = named.Split(',');
        HapticClient client = Components.Client(url);
        var drawn = new[] { "planks", "label", "weave" }.ToDictionary(name => Path.Combine(folder, name + ".jpg"), name => File.ReadAllBytes(Path.Combine(folder, name + ".drawn.rgba")));
        int encoded = 0, unknown = 0;
        ImageConversion.Jpeg = null;
        ImageConversion.Encode = pixels =>
        {
            string file = drawn.FirstOrDefault(each => each.Value.SequenceEqual(pixels)).Key;
            if (file == null) unknown++;
            encoded++;
            return File.ReadAllBytes(file ?? drawn.First().Key);
        };
        var materials = new Material[3];
        for (int i = 0; i < 3; i++)
        {
            materials[i] = new Material { name = Names[i] };
            materials[i].Set("_BaseMap", Read(folder, sizes[i]));
        }
        materials[1].renderQueue = 3000; // transparent
        GameObject thing = SurfaceRooms.Panels("mesh2057757694", materials, i => 1f - 0.1f * i);
        thing.AddComponent<BoxCollider>();
        var one = thing.AddComponent<HapticObject>();
        var decided = new SortedDictionary<long, string>();
        client.Decided += decision => { if (decision.ObjectId == one.ObjectId) decided[decision.Surface ?? 0] = decision.Material + " by " + decision.Source; };
        Components.Run(() => client.IsOwner, "no welcome");
        thing.SetActive(true);
        float loadedAt = Time.unscaledTime;
        UnityEngine.SceneManagement.SceneManager.Load();
        AsyncGPUReadback.IsDeviceLost = true;
        Components.Run(() => UnityEngine.Graphics.Blits > 0, "no map is read");
        Components.Say("first map after " + (Time.unscaledTime - loadedAt >= 2f ? "2 s" : "less"));
        Components.RunFor(5);
        AsyncGPUReadback.IsDeviceLost = false;
        Player.ResetFigures();
        Components.Run(() => decided.Count >= 2, "the maps are not decided");
        foreach (KeyValuePair<long, string> each in decided) Components.Say("decided " + each.Key + " " + each.Value);
        var stated = (SceneObject)typeof(HapticObject).GetMethod("Describe", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic).Invoke(one, null);
        foreach (ObjectSurface surface in stated.Surfaces) Components.Say("stated " + surface.Name + " " + surface.Texture);
        one.State(""); // described again: the maps are known and were asked for
        Components.RunFor(120);
        Components.Say("encoded " + encoded + " unknown " + unknown + " blits " + UnityEngine.Graphics.Blits + " active " + (RenderTexture.active == null) + " exceptions " + Debug.Exceptions + " errors " + Debug.Errors);
        Object.Destroy(client.gameObject);
        Components.RunFor(5);
        Components.Say("left textures " + RenderTexture.Live);
    }

    // A map is named NAME:WIDTHxHEIGHT.
    static Texture2D Read(string folder, string named)
    {
        string[] parts = named.Split(':', 'x');
        return new Texture2D(int.Parse(parts[1]), int.Parse(parts[2])) { name = "T_" + parts[0], Picture = File.ReadAllBytes(Path.Combine(folder, parts[0] + ".rgba")) };
    }
}
