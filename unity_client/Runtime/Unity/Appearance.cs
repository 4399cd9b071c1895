using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;
using Shader = UnityEngine.Shader;

namespace HapticVLM
{
    /// <summary>Reads the names and shader parameters of a game object for the service.</summary>
    internal static class Appearance
    {
        const int TransparentQueue = 3000; // RenderQueue.Transparent

        static readonly int Metallic = Shader.PropertyToID("_Metallic");
        static readonly int MetallicMap = Shader.PropertyToID("_MetallicGlossMap");
        static readonly int Smoothness = Shader.PropertyToID("_Smoothness");
        static readonly int Glossiness = Shader.PropertyToID("_Glossiness");
        static readonly int BaseColor = Shader.PropertyToID("_BaseColor");
        static readonly int OldColor = Shader.PropertyToID("_Color");

        public static void Read(GameObject of, ref SceneObject stated)
        {
            var renderer = of.GetComponentInChildren<Renderer>();
            Material material = renderer == null ? null : renderer.sharedMaterial;
            stated.Name = Name(of, material);
            if (material != null) stated.Shader = Parameters(material);
        }

        /// <summary>Joins the names of renderer material, collider material and object, which is the noun, behind those of its parents.</summary>
        static string Name(GameObject of, Material material)
        {
            string name = of.name;
            var collider = of.GetComponentInChildren<Collider>();
            var surface = collider == null ? null : collider.sharedMaterial;
            if (surface != null) name = surface.name + " " + name;
            if (material != null) name = material.name + " " + name;
            for (Transform parent = of.transform.parent; parent != null; parent = parent.parent)
            {
                string path = parent.name + "/" + name;
                if (path.Length > SceneObject.NameMaxLength) break;
                name = path;
            }
            return WireText.Within(name, SceneObject.NameMaxLength);
        }

        static HapticVLM.Wire.Shader? Parameters(Material material)
        {
            var shader = default(HapticVLM.Wire.Shader);
            bool hasMap = material.HasProperty(MetallicMap) && material.GetTexture(MetallicMap) != null;
            if (!hasMap) // with a map the numeric values have no effect
            {
                shader.Metallic = Share(material, Metallic);
                double? smooth = Share(material, Smoothness) ?? Share(material, Glossiness);
                if (smooth != null) shader.Roughness = 1.0 - smooth.Value;
            }
            int key = material.HasProperty(BaseColor) ? BaseColor : OldColor;
            if (material.HasProperty(key)) ReadColor(material, key, ref shader);
            return shader;
        }

        static void ReadColor(Material material, int key, ref HapticVLM.Wire.Shader shader)
        {
            Color color = material.GetColor(key);
            shader.BaseColor = new List<double> { Clamped(color.r), Clamped(color.g), Clamped(color.b) };
            if (material.renderQueue >= TransparentQueue) shader.Transmission = 1.0 - Clamped(color.a);
        }

        static double? Share(Material material, int key)
        {
            return material.HasProperty(key) ? Clamped(material.GetFloat(key)) : (double?)null;
        }

        static double Clamped(float value)
        {
            return value > 0f ? Math.Min(value, 1.0) : 0.0; // HDR colours exceed 1
        }
    }
}
